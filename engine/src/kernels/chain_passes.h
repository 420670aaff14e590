#pragma once
// The passes that a chain compiles to: one loop each over a block of elements. Internal linkage, like simd.h.
#include <cstdint>
#include <cstring>

#include "kernels/chain_operations.h"

namespace fieldmark::kernels {
namespace {

using detail::ChainStep;

constexpr int kChainValues = detail::kChainInputs + detail::kChainSteps;

// Where an array lies while blocks are run: at `at` for memory that every block uses again, at `at` plus the
// first element of the block for an array of the caller.
template <class T>
struct Place {
  T* at;
  Index moves;  // all bits set: moves with the block

  static Place fixed(T* p) { return {p, 0}; }
  static Place moving(T* p) { return {p, ~Index{0}}; }
  T* block(Index first) const { return at + (first & moves); }
  explicit operator bool() const { return at != nullptr; }
  operator Place<const T>() const { return {at, moves}; }
};

// out[i] = before[i] (null: 0) + a function of a[i], b[i], y[i], g[i], p and q; see Operands.
template <class T>
struct Pass {
  void (*run)(const Pass&, Index first, Index n);  // n elements, whole vectors
  Place<const T> a, b, y, g, before;
  Place<T> out;
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

// Makes streamed stores visible to threads that a plain store releases.
inline void finish_streams() {
#if defined(__SSE2__)
  __builtin_ia32_sfence();
#endif
}

// What a pass computes of a step.
enum class Part { value, to_a, to_b };

template <class Op, Part part, class Vector>
[[gnu::always_inline]] inline Vector compute(const Operands<Vector>& o) {
  if constexpr (part == Part::value)
    return Op::value(o);
  else if constexpr (part == Part::to_a)
    return Op::to_a(o);
  else
    return Op::to_b(o);
}

template <class T, class Op, Part part, bool adds, bool streams>
void run_pass(const Pass<T>& s, Index first, Index n) {
  using Vector = simd::Vec<T>;
  const T *a = s.a.block(first), *b = s.b.block(first), *y = s.y.block(first), *g = s.g.block(first);
  [[maybe_unused]] const T* before = s.before.block(first);
  T* out = s.out.block(first);
  const Vector p = simd::broadcast(s.p), q = simd::broadcast(s.q);
#pragma GCC unroll 4
  for (Index i = 0; i < n; i += simd::kLanes<T>) {
    Vector v = compute<Op, part>(
        Operands<Vector>{simd::load(a + i), simd::load(b + i), simd::load(y + i), simd::load(g + i), p, q});
    if constexpr (adds) v = simd::load(before + i) + v;
    if constexpr (streams)
      stream(out + i, v);
    else
      simd::store(out + i, v);
  }
}

template <class T, Part part>
auto choose_pass(ChainOp op, bool adds, bool streams) {
  decltype(Pass<T>::run) run = nullptr;
  dispatch(op, [&](auto operation) {
    using Op = decltype(operation);
    if constexpr (part != Part::to_b || requires(Operands<simd::Vec<T>> o) { Op::to_b(o); })
      run = adds ? (streams ? run_pass<T, Op, part, true, true> : run_pass<T, Op, part, true, false>)
                 : (streams ? run_pass<T, Op, part, false, true> : run_pass<T, Op, part, false, false>);
  });
  return run;
}

// Where the values and gradients of a chain lie, by number of the value.
template <class T>
struct Places {
  Place<const T> value[kChainValues];
  Place<T> made[kChainValues];           // results of the steps
  Place<const T> grad[kChainValues];     // gradients of the steps' results
  Place<T> to[kChainValues];             // where gradients are summed; null: not wanted
  Place<T> streamed_grad[kChainValues];  // where a complete gradient goes past the caches; null: nowhere
  bool streams_value;                    // the result goes past the caches
};

// Which gradients a step contributes to. A gradient's first part is assigned, later ones are added to it.
struct Route {
  bool to_a, to_b, add_a, add_b, last_a, last_b;
};

// A chain's passes in the order of computation.
template <class T>
class Program {
 public:
  // needed: the values to compute, by number; null for all.
  void add_forward(const ChainSteps& chain, const bool* needed, const Places<T>& p) {
    for (int s = 0; s < chain.count; ++s) {
      const int y = chain.inputs + s;
      if (needed && !needed[y]) continue;
      const bool streams = p.streams_value && s + 1 == chain.count;
      Pass<T>& pass = append(chain.step[s], p, y);
      pass.y = pass.g = pass.a;
      pass.out = p.made[y];
      pass.run = choose_pass<T, Part::value>(chain.step[s].op, false, streams);
    }
  }

  // Changes p.grad where a sum passes its gradient on.
  void add_backward(const ChainSteps& chain, const Route* routes, Places<T>& p) {
    for (int s = chain.count - 1; s >= 0; --s) {
      const ChainStep& step = chain.step[s];
      const Route& r = routes[s];
      const int y = chain.inputs + s;
      // A sum passes its gradient on: where that is all of a step's gradient, both are one array.
      const auto passes_on = [&](bool first_operand, int value, bool add, bool last) {
        const bool unchanged = step.op == ChainOp::add || (step.op == ChainOp::sub && first_operand);
        if (!unchanged || add || !last || value < chain.inputs) return false;
        p.grad[value] = p.grad[y];
        return true;
      };
      if (r.to_a && !passes_on(true, step.a, r.add_a, r.last_a))
        add_gradient<Part::to_a>(step, p, y, step.a, r.add_a, r.last_a);
      if (r.to_b && !passes_on(false, step.b, r.add_b, r.last_b))
        add_gradient<Part::to_b>(step, p, y, step.b, r.add_b, r.last_b);
    }
  }

  // Runs n elements from `first`; n is a multiple of the lanes.
  void run(Index first, Index n) const {
    for (int k = 0; k < count_; ++k) pass_[k].run(pass_[k], first, n);
  }

 private:
  Pass<T>& append(const ChainStep& step, const Places<T>& p, int y) {
    Pass<T>& pass = pass_[count_++];
    pass = {.run = nullptr,
            .a = p.value[step.a],
            .b = p.value[step.b],
            .y = p.value[y],
            .g = p.grad[y],
            .before = {},
            .out = {},
            .p = static_cast<T>(step.p),
            .q = static_cast<T>(step.q)};
    return pass;
  }

  template <Part part>
  void add_gradient(const ChainStep& step, const Places<T>& p, int y, int value, bool add, bool last) {
    const bool streams = last && p.streamed_grad[value];
    Pass<T>& pass = append(step, p, y);
    pass.out = streams ? p.streamed_grad[value] : p.to[value];
    if (add) pass.before = p.to[value];
    pass.run = choose_pass<T, part>(step.op, add, streams);
  }

  int count_ = 0;
  Pass<T> pass_[3 * detail::kChainSteps];
};

}  // namespace
}  // namespace fieldmark::kernels
