#include <fieldmark/engine/ops/fused.h>

#include <memory>
#include <new>

#include "kernels/chain.h"
#include "ops/broadcast.h"

namespace fieldmark::detail {
namespace {

constexpr Index kRun = 1024;  // elements to which repeating inputs are expanded at a time

constexpr Index kLarge =
    Index{1} << 24;  // bytes of an array too large to stay in the caches until it is read again

// Finds the inputs that the last step depends on.
std::array<bool, kChainInputs> used_inputs(const ChainSteps& chain) {
  std::array<bool, kChainInputs + kChainSteps> live{};
  live[at(chain.inputs + chain.count - 1)] = true;
  for (int s = chain.count - 1; s >= 0; --s)
    if (live[at(chain.inputs + s)]) live[chain.step[s].a] = live[chain.step[s].b] = true;
  std::array<bool, kChainInputs> used{};
  std::copy_n(live.begin(), chain.inputs, used.begin());
  return used;
}

// Joins equal inputs and moves the distinct ones to the front, so that each gradient is assigned once.
template <class T>
ChainSteps join_equal_inputs(ChainSteps chain, Var<T>* inputs) {
  std::array<int, kChainInputs + kChainSteps> place{};
  int kept = 0;
  for (int k = 0; k < chain.inputs; ++k) {
    const auto same = [&](const Var<T>& v) { return v.id() == inputs[k].id(); };
    place[at(k)] = static_cast<int>(std::find_if(inputs, inputs + kept, same) - inputs);
    if (place[at(k)] == kept) inputs[kept++] = inputs[k];
  }
  for (int s = 0; s < chain.count; ++s) {
    ChainStep& step = chain.step[s];
    place[at(chain.inputs + s)] = kept + s;
    step.a = static_cast<std::uint8_t>(place[step.a]);
    step.b = static_cast<std::uint8_t>(place[step.b]);
  }
  chain.inputs = kept;
  return chain;
}

// A chain on the tape.
template <class T>
struct Recorded {
  const ChainSteps* chain;
  const Var<T>* inputs;  // distinct
  Shape shape;           // of the result

  bool large() const { return shape.size() * static_cast<Index>(sizeof(T)) >= kLarge; }
  bool repeats(int k) const { return inputs[k].shape().size() != shape.size(); }
  bool repeats() const {
    for (int k = 0; k < chain->inputs; ++k)
      if (repeats(k)) return true;
    return false;
  }
};

// Writes the elements [begin, end) of v, broadcast to the shape of the result, to `to`.
template <class T>
void expand(Var<T> v, const Broadcast& p, Index begin, Index end, T* to) {
  const bool constant = p.a.repeats[at(p.axes - 1)];
  p.for_runs(begin, end, [&](Index i, Index from, Index, Index n) {
    if (constant)
      std::fill_n(to + (i - begin), n, v.value()[from]);
    else
      std::copy_n(v.value() + from, n, to + (i - begin));
  });
}

// Calls run(begin, end, values) for chunks of the result in parallel; values[k][i - begin] is input k's
// element.
template <class T, class F>
void for_chunks(const Recorded<T>& r, F run) {
  const int inputs = r.chain->inputs;
  if (!r.repeats())
    return parallel_for(r.shape.size(), kGrain, [&](Index begin, Index end) {
      std::array<const T*, kChainInputs> values{};
      for (int k = 0; k < inputs; ++k) values[at(k)] = r.inputs[k].value() + begin;
      run(begin, end, values.data());
    });
  auto* plans = r.inputs[0].tape().template scratch<Broadcast>(inputs);
  for (int k = 0; k < inputs; ++k) new (plans + k) Broadcast("fused", r.inputs[k].shape(), r.shape);
  parallel_for(r.shape.size(), kGrain, [&](Index from, Index to) {
    std::array<std::array<T, kRun>, kChainInputs> expanded;
    std::array<const T*, kChainInputs> values{};
    for (Index begin = from; begin < to; begin += kRun) {
      const Index end = std::min(begin + kRun, to);
      for (int k = 0; k < inputs; ++k) {
        values[at(k)] = r.repeats(k) ? expanded[at(k)].data() : r.inputs[k].value() + begin;
        if (r.repeats(k)) expand(r.inputs[k], plans[k], begin, end, expanded[at(k)].data());
      }
      run(begin, end, values.data());
    }
  });
}

// dL/d(input k) = dy times the slope of input k, which the kernel computes step by step in reverse, summed
// over the axes on which the input repeats. A chunk owns its elements.
template <class T>
void backward(const Recorded<T>& r, const T* dy) {
  const int inputs = r.chain->inputs;
  const auto used = used_inputs(*r.chain);
  std::array<T*, kChainInputs> to{}, sums{};
  std::array<bool, kChainInputs> add{}, fresh{};
  for (int k = 0; k < inputs; ++k) {
    if (!used[at(k)]) continue;
    T* dx = r.inputs[k].grad_acc(&fresh[at(k)]);
    if (dx && r.repeats(k)) sums[at(k)] = std::exchange(dx, r.inputs[k].tape().scratch(r.shape.size()));
    to[at(k)] = dx;
    add[at(k)] = !sums[at(k)] && !fresh[at(k)];
  }
  using namespace kernels;
  const auto kernel = FIELDMARK_KERNEL(chain_backward<T>);
  for_chunks(r, [&](Index begin, Index end, const T* const* values) {
    std::array<T*, kChainInputs> parts{};
    for (int k = 0; k < inputs; ++k) parts[at(k)] = to[at(k)] ? to[at(k)] + begin : nullptr;
    kernel(*r.chain, values, dy + begin, parts.data(), add.data(), end - begin, r.large());
  });
  for (int k = 0; k < inputs; ++k) {
    if (!sums[at(k)]) continue;
    const Broadcast p("fused", r.inputs[k].shape(), r.shape);
    put_sums(r.inputs[k].tape(), to[at(k)], p.summed(p.a), 1, sums[at(k)], fresh[at(k)]);
  }
}

// Copies to memory of the tape.
template <class U, class T>
U* keep(Tape<T>& tape, std::span<const U> from) {
  U* to = tape.template scratch<U>(static_cast<Index>(from.size()));
  std::uninitialized_copy(from.begin(), from.end(), to);
  return to;
}

}  // namespace

template <class T>
Var<T> run_chain(const Chain& chain, std::span<const Var<T>> inputs, std::source_location from) {
  Tape<T>& tape = inputs[0].tape();
  Var<T>* different = keep(tape, inputs);
  const ChainSteps steps = join_equal_inputs(chain.steps(), different);
  Shape shape = inputs[0].shape();
  for (const Var<T>& v : inputs) shape = Broadcast("fused", shape, v.shape()).shape;
  T* y = nullptr;
  const Var<T> out = tape.output(shape, &y, std::span<const Var<T>>(different, at(steps.inputs)), from);
  const Recorded<T> r{keep(tape, std::span(&steps, 1)), different, shape};
  using namespace kernels;
  const auto forward = FIELDMARK_KERNEL(chain_forward<T>);
  for_chunks(r, [&](Index begin, Index end, const T* const* values) {
    forward(*r.chain, values, y + begin, end - begin, r.large());
  });
  tape.on_backward(out, [r](const T* dy) { backward(r, dy); });
  return out;
}

template Var<float> run_chain(const Chain&, std::span<const Var<float>>, std::source_location);
template Var<double> run_chain(const Chain&, std::span<const Var<double>>, std::source_location);

}  // namespace fieldmark::detail
