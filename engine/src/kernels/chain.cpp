#include "kernels/chain.h"

#include "kernels/chain_program.h"

namespace fieldmark::kernels {
namespace {

using detail::kChainInputs;
using detail::kChainSteps;

// `reached` tells which values have a gradient so far, `wanted` which need one.
void plan_routes(const ChainSteps& chain, const bool* wanted, bool* reached, Route* routes) {
  for (int s = chain.count - 1; s >= 0; --s) {
    const ChainStep& step = chain.step[s];
    Route& r = routes[s];
    const bool live = reached[chain.inputs + s];
    r.to_a = live && wanted[step.a];
    r.add_a = reached[step.a];
    if (r.to_a) reached[step.a] = true;
    r.to_b = live && is_binary(step.op) && wanted[step.b];
    r.add_b = reached[step.b];
    if (r.to_b) reached[step.b] = true;
  }
  bool complete[kChainValues] = {};
  for (int s = 0; s < chain.count; ++s) {
    const ChainStep& step = chain.step[s];
    Route& r = routes[s];
    r.last_b = r.to_b && !complete[step.b];
    complete[step.b] |= r.to_b;
    r.last_a = r.to_a && !complete[step.a];
    complete[step.a] |= r.to_a;
  }
}

// Finds the values that a backward recomputes.
void plan_values(const ChainSteps& chain, const Route* routes, bool* needed) {
  for (int s = 0; s < chain.count; ++s) {
    if (!routes[s].to_a && !routes[s].to_b) continue;
    const ChainStep& step = chain.step[s];
    const Reads reads = slope_reads(step.op);
    needed[step.a] |= reads.a;
    needed[step.b] |= reads.b;
    needed[chain.inputs + s] |= reads.y;
  }
  for (int s = chain.count - 1; s >= 0; --s)
    if (needed[chain.inputs + s]) needed[chain.step[s].a] = needed[chain.step[s].b] = true;
}

// What a backward computes.
struct GradientPlan {
  Route routes[kChainSteps];
  bool needed[kChainValues] = {};  // the values to recompute

  template <class T>
  GradientPlan(const ChainSteps& chain, T* const* dinputs, const bool* add) {
    bool wanted[kChainValues] = {}, reached[kChainValues] = {};
    for (int k = 0; k < chain.inputs; ++k) {
      wanted[k] = dinputs[k] != nullptr;
      reached[k] = wanted[k] && add[k];
    }
    for (int s = 0; s < chain.count; ++s)
      wanted[chain.inputs + s] = wanted[chain.step[s].a] || wanted[chain.step[s].b];
    reached[chain.inputs + chain.count - 1] = true;
    plan_routes(chain, wanted, reached, routes);
    plan_values(chain, routes, needed);
  }
};

// The kernels below for a whole number of vectors.
template <class T>
void forward_vectors(const ChainSteps& chain, const T* const* inputs, T* y, Index n, bool large) {
  alignas(64) T made[kChainSteps][kBlock<T>];
  Places<T> places{};
  for (int k = 0; k < chain.inputs; ++k) places.value[k] = Place<const T>::moving(inputs[k]);
  for (int s = 0; s < chain.count; ++s)
    places.value[chain.inputs + s] = places.made[chain.inputs + s] = Place<T>::fixed(made[s]);
  places.made[chain.inputs + chain.count - 1] = Place<T>::moving(y);
  places.streams_value = large && can_stream(y);
  Program<T> program;
  program.add_forward(chain, nullptr, places);
  program.run(n);
}

template <class T>
void backward_vectors(const ChainSteps& chain, const T* const* inputs, const T* dy, T* const* dinputs,
                      const bool* add, Index n, bool large) {
  alignas(64) T made[kChainSteps][kBlock<T>];
  alignas(64) T grads[kChainSteps][kBlock<T>];
  alignas(64) T sums[kChainInputs][kBlock<T>];  // parts of gradients that are streamed when they are complete
  const GradientPlan plan(chain, dinputs, add);
  Places<T> places{};
  for (int k = 0; k < chain.inputs; ++k) {
    places.value[k] = Place<const T>::moving(inputs[k]);
    if (!dinputs[k]) continue;
    const auto result = Place<T>::moving(dinputs[k]);
    const bool streams = large && !add[k] && can_stream(dinputs[k]);
    if (streams) places.streamed_grad[k] = result;
    places.to[k] = streams ? Place<T>::fixed(sums[k]) : result;
  }
  for (int s = 0; s < chain.count; ++s) {
    const int v = chain.inputs + s;
    places.value[v] = places.made[v] = Place<T>::fixed(made[s]);
    places.grad[v] = places.to[v] = Place<T>::fixed(grads[s]);
  }
  places.grad[chain.inputs + chain.count - 1] = Place<const T>::moving(dy);
  Program<T> program;
  program.add_forward(chain, plan.needed, places);
  program.add_backward(chain, plan.routes, places);
  program.run(n);
}

// One vector of n elements and padding.
template <class T>
struct Padded {
  alignas(64) T element[simd::kLanes<T>];
  // Ones are harmless operands of every step.
  T* fill(const T* from, Index n) {
    for (Index i = 0; i < simd::kLanes<T>; ++i) element[i] = i < n ? from[i] : T(1);
    return element;
  }
  void write(T* to, Index n) const { std::memcpy(to, element, static_cast<std::size_t>(n) * sizeof(T)); }
};

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
void chain_forward(const ChainSteps& chain, const T* const* inputs, T* y, Index n, bool large) {
  const Index rest = n % simd::kLanes<T>, whole = n - rest;
  if (whole > 0) forward_vectors(chain, inputs, y, whole, large);
  if (rest > 0) {
    Padded<T> end[kChainInputs], y_end;
    const T* ends[kChainInputs];
    for (int k = 0; k < chain.inputs; ++k) ends[k] = end[k].fill(inputs[k] + whole, rest);
    forward_vectors(chain, ends, y_end.element, simd::kLanes<T>, false);
    y_end.write(y + whole, rest);
  }
  if (large) finish_streams();
}

template <class T>
void chain_backward(const ChainSteps& chain, const T* const* inputs, const T* dy, T* const* dinputs,
                    const bool* add, Index n, bool large) {
  const Index rest = n % simd::kLanes<T>, whole = n - rest;
  if (whole > 0) backward_vectors(chain, inputs, dy, dinputs, add, whole, large);
  if (rest > 0) {
    Padded<T> end[kChainInputs], gradient_end[kChainInputs], dy_end;
    const T* ends[kChainInputs];
    T* gradient_ends[kChainInputs] = {};
    for (int k = 0; k < chain.inputs; ++k) {
      ends[k] = end[k].fill(inputs[k] + whole, rest);
      if (dinputs[k]) gradient_ends[k] = gradient_end[k].fill(dinputs[k] + whole, rest);
    }
    backward_vectors(chain, ends, dy_end.fill(dy + whole, rest), gradient_ends, add, simd::kLanes<T>, false);
    for (int k = 0; k < chain.inputs; ++k)
      if (dinputs[k]) gradient_end[k].write(dinputs[k] + whole, rest);
  }
  if (large) finish_streams();
}

template void chain_forward(const ChainSteps&, const float* const*, float*, Index, bool);
template void chain_forward(const ChainSteps&, const double* const*, double*, Index, bool);
template void chain_backward(const ChainSteps&, const float* const*, const float*, float* const*, const bool*,
                             Index, bool);
template void chain_backward(const ChainSteps&, const double* const*, const double*, double* const*,
                             const bool*, Index, bool);

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
