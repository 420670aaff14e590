#include "kernels/chain.h"

#include "kernels/chain_operations.h"

namespace fieldmark::kernels {
namespace {

using detail::ChainStep;
using detail::kChainInputs;
using detail::kChainSteps;

// Elements per block: all values of a chain stay in the L1 cache. Large arrays take smaller blocks, whose
// prefetches the CPU can hold at a time.
constexpr Index kBlock = 256, kLargeBlock = 128;
constexpr int kValues = kChainInputs + kChainSteps;

template <class T>
struct Arrays {
  const T *a, *b, *y, *g;
  T p, q;
};

// Stores past the caches, which saves reading the memory that is overwritten. p must be aligned to vectors.
template <class T>
[[gnu::always_inline]] inline void stream(T* p, simd::Vec<T> value) {
  simd::Vec<float> v;
  std::memcpy(&v, &value, sizeof v);
  auto* to = reinterpret_cast<float*>(p);
#if defined(__AVX512F__)
  __builtin_ia32_movntps512(to, v);
#elif defined(__AVX2__)
  __builtin_ia32_movntps256(to, v);
#else
  __builtin_ia32_movntps(to, v);
#endif
}
template <class T>
inline bool can_stream(const T* p) {
  return reinterpret_cast<std::uintptr_t>(p) % simd::kBytes == 0;
}

// Where a loop writes: out[i] = before[i] (null: 0) + its value.
template <class T>
struct Target {
  T* out;
  const T* before = nullptr;
  bool streams = false;  // see stream()
};

// Writes f(operands i) for n elements in whole vectors.
template <class T, class F>
inline void loop(const Arrays<T>& s, const Target<T>& to, Index n, F f) {
  using Vector = simd::Vec<T>;
  constexpr int lanes = simd::kLanes<T>;
  const Vector p = simd::broadcast(s.p), q = simd::broadcast(s.q);
  const auto value = [&](Index i) {
    return f(Operands<Vector>{simd::load(s.a + i), simd::load(s.b + i), simd::load(s.y + i),
                              simd::load(s.g + i), p, q});
  };
  const auto sum = [&](Index i) { return simd::load(to.before + i) + value(i); };
  if (to.before && to.streams)
#pragma GCC unroll 4
    for (Index i = 0; i < n; i += lanes) stream(to.out + i, sum(i));
  else if (to.before)
#pragma GCC unroll 4
    for (Index i = 0; i < n; i += lanes) simd::store(to.out + i, sum(i));
  else if (to.streams)
#pragma GCC unroll 4
    for (Index i = 0; i < n; i += lanes) stream(to.out + i, value(i));
  else
#pragma GCC unroll 4
    for (Index i = 0; i < n; i += lanes) simd::store(to.out + i, value(i));
}

// The values and gradients of one block, by number of the value.
template <class T>
struct Block {
  const T* value[kValues];
  T* made[kValues];  // memory of the steps' values
  const T* grad[kValues];
  T* to[kValues];                  // memory for gradients; null: not wanted
  T* streamed_value = nullptr;     // where the last value goes past the caches; null: nowhere
  T* streamed_grad[kValues] = {};  // where a gradient goes past the caches when it is complete; null: nowhere
  Index n;                         // a multiple of the lanes
};

// needed: the values to compute, by number; null for all.
template <class T>
void run_forward(const ChainSteps& chain, const bool* needed, Block<T>& b) {
  for (int s = 0; s < chain.count; ++s) {
    const ChainStep& step = chain.step[s];
    const int y = chain.inputs + s;
    if (needed && !needed[y]) continue;
    const T *va = b.value[step.a], *vb = b.value[step.b];
    const Arrays<T> arrays{va, vb, va, va, static_cast<T>(step.p), static_cast<T>(step.q)};
    const bool streams = b.streamed_value && s + 1 == chain.count;
    const Target<T> to{.out = streams ? b.streamed_value : b.made[y], .streams = streams};
    dispatch(step.op, [&](auto op) { loop(arrays, to, b.n, [](auto o) { return decltype(op)::value(o); }); });
  }
}

// Which gradients a step contributes to. A gradient's first part is assigned, later ones are added to it.
struct Route {
  bool to_a, to_b, add_a, add_b, last_a, last_b;
};

template <class T>
Target<T> target(const Block<T>& b, int value, bool add, bool last) {
  const bool streams = last && b.streamed_grad[value];
  return {.out = streams ? b.streamed_grad[value] : b.to[value],
          .before = add ? b.to[value] : nullptr,
          .streams = streams};
}

template <class T>
void run_backward(const ChainSteps& chain, const Route* routes, Block<T>& b) {
  for (int s = chain.count - 1; s >= 0; --s) {
    const ChainStep& step = chain.step[s];
    const int y = chain.inputs + s;
    const Route& r = routes[s];
    const Arrays<T> arrays{b.value[step.a], b.value[step.b],        b.value[y],
                           b.grad[y],       static_cast<T>(step.p), static_cast<T>(step.q)};
    // A sum passes its gradient on: where that is all of a step's gradient, both are one array.
    const auto passes_on = [&](bool first_operand, int value, bool add, bool last) {
      const bool unchanged = step.op == ChainOp::add || (step.op == ChainOp::sub && first_operand);
      if (!unchanged || add || !last || value < chain.inputs) return false;
      b.grad[value] = b.grad[y];
      return true;
    };
    dispatch(step.op, [&](auto op) {
      using Op = decltype(op);
      if (r.to_a && !passes_on(true, step.a, r.add_a, r.last_a))
        loop(arrays, target(b, step.a, r.add_a, r.last_a), b.n, [](auto o) { return Op::to_a(o); });
      if constexpr (requires(Operands<simd::Vec<T>> o) { Op::to_b(o); })
        if (r.to_b && !passes_on(false, step.b, r.add_b, r.last_b))
          loop(arrays, target(b, step.b, r.add_b, r.last_b), b.n, [](auto o) { return Op::to_b(o); });
    });
  }
}

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
  bool complete[kValues] = {};
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

// Padded copies of array ends, for a last block that is not a whole number of vectors.
template <class T>
struct Tails {
  alignas(64) T inputs[kChainInputs][kBlock];
  alignas(64) T dinputs[kChainInputs][kBlock];
  alignas(64) T y[kBlock];
};

template <class T>
Index whole_vectors(Index n) {
  constexpr Index lanes = simd::kLanes<T>;
  return (n + lanes - 1) / lanes * lanes;
}
template <class T>
void copy(const T* from, T* to, Index n) {
  std::memcpy(to, from, static_cast<std::size_t>(n) * sizeof(T));
}
// Returns the n elements, padded with ones to whole vectors: 1 is a harmless operand of every step.
template <class T>
const T* padded(const T* from, T* to, Index n) {
  copy(from, to, n);
  for (Index i = n; i < whole_vectors<T>(n); ++i) to[i] = 1;
  return to;
}

// Prefetches the block after the one at i while that is computed: chains of several steps would otherwise
// wait for memory.
template <class T>
inline void fetch_next(const T* p, Index i, Index block, Index n) {
  constexpr Index line = 64 / static_cast<Index>(sizeof(T));
  const Index end = n - i < 2 * block ? n : i + 2 * block;
  for (Index k = i + block; k < end; k += line) __builtin_prefetch(p + k);
}

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
void chain_forward(const ChainSteps& chain, const T* const* inputs, T* y, Index n, bool large) {
  alignas(64) T made[kChainSteps][kBlock];
  Tails<T> tails;
  Block<T> b;
  const int last = chain.inputs + chain.count - 1;
  const Index block = large ? kLargeBlock : kBlock;
  for (Index i = 0; i < n; i += block) {
    const Index count = n - i < block ? n - i : block;
    b.n = whole_vectors<T>(count);
    const bool whole = b.n == count;
    for (int k = 0; k < chain.inputs; ++k)
      b.value[k] = whole ? inputs[k] + i : padded(inputs[k] + i, tails.inputs[k], count);
    for (int s = 0; s < chain.count; ++s) b.value[chain.inputs + s] = b.made[chain.inputs + s] = made[s];
    b.streamed_value = large && whole && can_stream(y + i) ? y + i : nullptr;
    if (whole) b.made[last] = y + i;
    for (int k = 0; k < chain.inputs; ++k) fetch_next(inputs[k], i, block, n);
    run_forward(chain, nullptr, b);
    if (!whole) copy(b.made[last], y + i, count);
  }
}

template <class T>
void chain_backward(const ChainSteps& chain, const T* const* inputs, const T* dy, T* const* dinputs,
                    const bool* add, Index n, bool large) {
  alignas(64) T made[kChainSteps][kBlock];
  alignas(64) T grads[kChainSteps][kBlock];
  Tails<T> tails;
  Block<T> b;
  Route routes[kChainSteps];
  bool wanted[kValues] = {}, reached[kValues] = {}, needed[kValues] = {};
  const int last = chain.inputs + chain.count - 1;
  const Index block = large ? kLargeBlock : kBlock;
  for (int k = 0; k < chain.inputs; ++k) {
    wanted[k] = dinputs[k] != nullptr;
    reached[k] = wanted[k] && add[k];
  }
  for (int s = 0; s < chain.count; ++s)
    wanted[chain.inputs + s] = wanted[chain.step[s].a] || wanted[chain.step[s].b];
  reached[last] = true;
  plan_routes(chain, wanted, reached, routes);
  plan_values(chain, routes, needed);
  for (Index i = 0; i < n; i += block) {
    const Index count = n - i < block ? n - i : block;
    b.n = whole_vectors<T>(count);
    const bool whole = b.n == count;
    for (int k = 0; k < chain.inputs; ++k) {
      b.value[k] = whole ? inputs[k] + i : padded(inputs[k] + i, tails.inputs[k], count);
      const bool streams = large && whole && wanted[k] && !add[k] && can_stream(dinputs[k] + i);
      b.streamed_grad[k] = streams ? dinputs[k] + i : nullptr;
      b.to[k] = wanted[k] ? (whole && !streams ? dinputs[k] + i : tails.dinputs[k]) : nullptr;
      if (wanted[k] && !whole) copy(dinputs[k] + i, tails.dinputs[k], count);
    }
    for (int s = 0; s < chain.count; ++s) {
      b.value[chain.inputs + s] = b.made[chain.inputs + s] = made[s];
      b.grad[chain.inputs + s] = b.to[chain.inputs + s] = grads[s];
    }
    b.grad[last] = whole ? dy + i : padded(dy + i, tails.y, count);
    for (int k = 0; k < chain.inputs; ++k) {
      fetch_next(inputs[k], i, block, n);
      if (wanted[k] && !b.streamed_grad[k]) fetch_next<T>(dinputs[k], i, block, n);
    }
    fetch_next(dy, i, block, n);
    run_forward(chain, needed, b);
    run_backward(chain, routes, b);
    for (int k = 0; k < chain.inputs; ++k)
      if (wanted[k] && !whole) copy(tails.dinputs[k], dinputs[k] + i, count);
  }
}

template void chain_forward(const ChainSteps&, const float* const*, float*, Index, bool);
template void chain_forward(const ChainSteps&, const double* const*, double*, Index, bool);
template void chain_backward(const ChainSteps&, const float* const*, const float*, float* const*, const bool*,
                             Index, bool);
template void chain_backward(const ChainSteps&, const double* const*, const double*, double* const*,
                             const bool*, Index, bool);

}  // namespace FIELDMARK_ISA_NS
}  // namespace fieldmark::kernels
