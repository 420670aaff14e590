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
  int writer;   // the pass that writes it, counted from 1; 0: the caller's

  static Place fixed(T* p) { return {p, 0, 0}; }
  static Place moving(T* p) { return {p, ~Index{0}, 0}; }
  T* block(Index first) const { return at + (first & moves); }
  explicit operator bool() const { return at != nullptr; }
  operator Place<const T>() const { return {at, moves, writer}; }
};

// A block is as many vectors as every ABI passes in registers: a pass hands its block to the next one there,
// because each further store and load in L1 would cost as much as the arithmetic between them.
constexpr int kVectors = 8;
template <class T>
constexpr Index kBlock = kVectors* simd::kLanes<T>;

// out[i] = before[i] (null: 0) + a function of a[i], b[i], y[i], g[i], p and q; see Operands. One operand
// comes in registers: a or b of a value, g of a gradient.
template <class T>
struct Pass {
  using V = simd::Vec<T>;
  using Run = void (*)(const Pass*, Index first, V, V, V, V, V, V, V, V);
  Run wide, narrow;  // run this pass and those after it, on a block and on one vector
  Place<const T> a, b, y, g, before;
  Place<T> out;
  T p, q;
  bool loads;    // the operand in registers is loaded first
  bool stores;   // the result is read from memory, too
  bool streams;  // the result goes past the caches
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

// Streamed stores are weakly ordered: without this fence they could become visible after the release store
// with which the pool publishes that a chunk is done.
inline void finish_streams() {
#if defined(__SSE2__)
  __builtin_ia32_sfence();
#endif
}

// Calls f(k, offset of vector k) for each vector of a block. Registers have no index at run time.
template <class T, int vectors, class F>
[[gnu::always_inline]] inline void for_vectors(F f) {
#pragma GCC unroll 8
  for (int k = 0; k < vectors; ++k) f(k, k * simd::kLanes<T>);
}

template <int vectors, class T>
[[gnu::always_inline]] inline void put(T* out, const simd::Vec<T>* v, bool streams) {
  if (streams)
    for_vectors<T, vectors>([&](int k, Index i) { stream(out + i, v[k]); });
  else
    for_vectors<T, vectors>([&](int k, Index i) { simd::store(out + i, v[k]); });
}

// Replaces operand a (second: b) in registers by the value of a step.
template <class Op, bool second>
struct Value {
  template <int vectors, class T>
  [[gnu::always_inline]] static void run(const Pass<T>& s, Index first, simd::Vec<T>* r) {
    using Vector = simd::Vec<T>;
    const T *a = s.a.block(first), *b = s.b.block(first);
    const Vector p = simd::broadcast(s.p), q = simd::broadcast(s.q);
    if (s.loads) for_vectors<T, vectors>([&](int k, Index i) { r[k] = simd::load((second ? b : a) + i); });
    for_vectors<T, vectors>([&](int k, Index i) {
      const Vector other = simd::load((second ? a : b) + i), none{};
      r[k] = Op::value(Operands<Vector>{second ? other : r[k], second ? r[k] : other, none, none, p, q});
    });
    if (s.stores) put<vectors>(s.out.block(first), r, s.streams);
  }
};

// Computes dL/da (second: dL/db) from g in registers, and leaves it or g there.
template <class Op, bool second, bool adds, bool leaves>
struct Gradient {
  template <int vectors, class T>
  [[gnu::always_inline]] static void run(const Pass<T>& s, Index first, simd::Vec<T>* r) {
    using Vector = simd::Vec<T>;
    const T *a = s.a.block(first), *b = s.b.block(first), *y = s.y.block(first), *g = s.g.block(first);
    [[maybe_unused]] const T* before = s.before.block(first);
    const Vector p = simd::broadcast(s.p), q = simd::broadcast(s.q);
    Vector v[kVectors];
    if (s.loads) for_vectors<T, vectors>([&](int k, Index i) { r[k] = simd::load(g + i); });
    for_vectors<T, vectors>([&](int k, Index i) {
      const Operands<Vector> o{simd::load(a + i), simd::load(b + i), simd::load(y + i), r[k], p, q};
      if constexpr (second)
        v[k] = Op::to_b(o);
      else
        v[k] = Op::to_a(o);
      if constexpr (adds) v[k] = simd::load(before + i) + v[k];
    });
    // Not in the loop above: a branch there would keep GCC from contracting a product and a sum.
    if (!leaves || s.stores) put<vectors>(s.out.block(first), v, s.streams);
    if (leaves) for_vectors<T, vectors>([&](int k, Index) { r[k] = v[k]; });
  }
};

// The call of the next pass is a jump: eight vectors are arguments in registers.
template <class T, class Work, int vectors, class V = simd::Vec<T>>
void run_pass(const Pass<T>* s, Index first, V r0, V r1, V r2, V r3, V r4, V r5, V r6, V r7) {
  V r[kVectors] = {r0, r1, r2, r3, r4, r5, r6, r7};
  Work::template run<vectors>(*s, first, r);
  const Pass<T>* next = s + 1;
  const auto run = vectors == 1 ? next->narrow : next->wide;
  run(next, first, r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7]);
}
template <class T, class V = simd::Vec<T>>
void end_passes(const Pass<T>*, Index, V, V, V, V, V, V, V, V) {}

// The last pass returns with vectors in use, which the compiler does not know of: SSE code of the caller
// would run several times as slow.
inline void leave_vectors() {
#if defined(__AVX__)
  __builtin_ia32_vzeroupper();
#endif
}

template <class Work, class T>
void set_work(Pass<T>& pass) {
  pass.wide = run_pass<T, Work, kVectors>;
  pass.narrow = run_pass<T, Work, 1>;
}

template <class T>
void choose_value(ChainOp op, bool second, Pass<T>& pass) {
  dispatch(op, [&](auto operation) {
    using Op = decltype(operation);
    if constexpr (requires(Operands<simd::Vec<T>> o) { Op::to_b(o); })
      if (second) return set_work<Value<Op, true>>(pass);
    set_work<Value<Op, false>>(pass);
  });
}

template <bool second, class T>
void choose_gradient(ChainOp op, bool adds, bool leaves, Pass<T>& pass) {
  dispatch(op, [&](auto operation) {
    using Op = decltype(operation);
    if constexpr (!second || requires(Operands<simd::Vec<T>> o) { Op::to_b(o); }) {
      if (adds)
        leaves ? set_work<Gradient<Op, second, true, true>>(pass)
               : set_work<Gradient<Op, second, true, false>>(pass);
      else
        leaves ? set_work<Gradient<Op, second, false, true>>(pass)
               : set_work<Gradient<Op, second, false, false>>(pass);
    }
  });
}

}  // namespace
}  // namespace fieldmark::kernels
