#include "kernels/chain.h"

#include "kernels/chain_operations.h"

namespace fieldmark::kernels {
namespace {

using detail::ChainStep;
using detail::kChainInputs;
using detail::kChainSteps;

// Elements per block: all values of a chain stay in the L1 cache.
constexpr Index kBlock = 256;
constexpr int kValues = kChainInputs + kChainSteps;

template <class T>
struct Arrays {
  const T *a, *b, *y, *g;
  T p, q;
};

// out[i] = or += f(operands i), for n elements in whole vectors.
template <class T, class F>
inline void loop(const Arrays<T>& s, bool add, T* out, Index n, F f) {
  using Vector = simd::Vec<T>;
  constexpr int lanes = simd::kLanes<T>;
  const Vector p = simd::broadcast(s.p), q = simd::broadcast(s.q);
  const auto value = [&](Index i) {
    return f(Operands<Vector>{simd::load(s.a + i), simd::load(s.b + i), simd::load(s.y + i),
                              simd::load(s.g + i), p, q});
  };
  if (add)
#pragma GCC unroll 4
    for (Index i = 0; i < n; i += lanes) simd::store(out + i, simd::load(out + i) + value(i));
  else
#pragma GCC unroll 4
    for (Index i = 0; i < n; i += lanes) simd::store(out + i, value(i));
}

// The values and gradients of one block, by number of the value.
template <class T>
struct Block {
  const T* value[kValues];
  T* made[kValues];  // memory of the steps' values
  const T* grad[kValues];
  T* to[kValues];  // memory for gradients; null: not wanted
  Index n;         // a multiple of the lanes
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
    dispatch(step.op, [&](auto op) {
      loop(arrays, false, b.made[y], b.n, [](auto o) { return decltype(op)::value(o); });
    });
  }
}

// Which gradients a step contributes to, and whether it is the first, which assigns.
struct Route {
  bool to_a, to_b, add_a, add_b;
};

template <class T>
void run_backward(const ChainSteps& chain, const Route* routes, const Block<T>& b) {
  for (int s = chain.count - 1; s >= 0; --s) {
    const ChainStep& step = chain.step[s];
    const int y = chain.inputs + s;
    const Route& r = routes[s];
    const Arrays<T> arrays{b.value[step.a], b.value[step.b],        b.value[y],
                           b.grad[y],       static_cast<T>(step.p), static_cast<T>(step.q)};
    dispatch(step.op, [&](auto op) {
      using Op = decltype(op);
      if (r.to_a) loop(arrays, r.add_a, b.to[step.a], b.n, [](auto o) { return Op::to_a(o); });
      if constexpr (requires(Operands<simd::Vec<T>> o) { Op::to_b(o); })
        if (r.to_b) loop(arrays, r.add_b, b.to[step.b], b.n, [](auto o) { return Op::to_b(o); });
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

// Copies whole vectors with stores that bypass the caches, which saves reading the overwritten memory. `to`
// must be aligned to vectors.
template <class T>
inline void stream(const T* from, T* to, Index n) {
  constexpr Index lanes = simd::kLanes<T>;
  for (Index i = 0; i < n; i += lanes) {
    simd::Vec<float> v;
    std::memcpy(&v, from + i, sizeof v);
    auto* p = reinterpret_cast<float*>(to + i);
#if defined(__AVX512F__)
    __builtin_ia32_movntps512(p, v);
#elif defined(__AVX2__)
    __builtin_ia32_movntps256(p, v);
#else
    __builtin_ia32_movntps(p, v);
#endif
  }
}
template <class T>
inline bool can_stream(const T* p) {
  return reinterpret_cast<std::uintptr_t>(p) % simd::kBytes == 0;
}

// Prefetches the block after the one at i while that is computed: chains of several steps would otherwise
// wait for memory.
template <class T>
inline void fetch_next(const T* p, Index i, Index n) {
  constexpr Index line = 64 / static_cast<Index>(sizeof(T));
  const Index end = n - i < 2 * kBlock ? n : i + 2 * kBlock;
  for (Index k = i + kBlock; k < end; k += line) __builtin_prefetch(p + k);
}

}  // namespace

namespace FIELDMARK_ISA_NS {

template <class T>
void chain_forward(const ChainSteps& chain, const T* const* inputs, T* y, Index n, bool large) {
  alignas(64) T made[kChainSteps][kBlock];
  Tails<T> tails;
  Block<T> b;
  const int last = chain.inputs + chain.count - 1;
  for (Index i = 0; i < n; i += kBlock) {
    const Index count = n - i < kBlock ? n - i : kBlock;
    b.n = whole_vectors<T>(count);
    const bool whole = b.n == count;
    for (int k = 0; k < chain.inputs; ++k)
      b.value[k] = whole ? inputs[k] + i : padded(inputs[k] + i, tails.inputs[k], count);
    for (int s = 0; s < chain.count; ++s) b.value[chain.inputs + s] = b.made[chain.inputs + s] = made[s];
    const bool streams = large && whole && can_stream(y + i);
    if (whole && !streams) b.made[last] = y + i;
    for (int k = 0; k < chain.inputs; ++k) fetch_next(inputs[k], i, n);
    run_forward(chain, nullptr, b);
    if (streams)
      stream(b.made[last], y + i, count);
    else if (!whole)
      copy(b.made[last], y + i, count);
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
  bool wanted[kValues] = {}, reached[kValues] = {}, needed[kValues] = {}, streams[kChainInputs] = {};
  const int last = chain.inputs + chain.count - 1;
  for (int k = 0; k < chain.inputs; ++k) {
    wanted[k] = dinputs[k] != nullptr;
    reached[k] = wanted[k] && add[k];
  }
  for (int s = 0; s < chain.count; ++s)
    wanted[chain.inputs + s] = wanted[chain.step[s].a] || wanted[chain.step[s].b];
  reached[last] = true;
  plan_routes(chain, wanted, reached, routes);
  plan_values(chain, routes, needed);
  for (Index i = 0; i < n; i += kBlock) {
    const Index count = n - i < kBlock ? n - i : kBlock;
    b.n = whole_vectors<T>(count);
    const bool whole = b.n == count;
    for (int k = 0; k < chain.inputs; ++k) {
      b.value[k] = whole ? inputs[k] + i : padded(inputs[k] + i, tails.inputs[k], count);
      streams[k] = large && whole && wanted[k] && !add[k] && can_stream(dinputs[k] + i);
      b.to[k] = wanted[k] ? (whole && !streams[k] ? dinputs[k] + i : tails.dinputs[k]) : nullptr;
      if (wanted[k] && !whole) copy(dinputs[k] + i, tails.dinputs[k], count);
    }
    for (int s = 0; s < chain.count; ++s) {
      b.value[chain.inputs + s] = b.made[chain.inputs + s] = made[s];
      b.grad[chain.inputs + s] = b.to[chain.inputs + s] = grads[s];
    }
    b.grad[last] = whole ? dy + i : padded(dy + i, tails.y, count);
    for (int k = 0; k < chain.inputs; ++k) {
      fetch_next(inputs[k], i, n);
      if (wanted[k] && !streams[k]) fetch_next<T>(dinputs[k], i, n);
    }
    fetch_next(dy, i, n);
    run_forward(chain, needed, b);
    run_backward(chain, routes, b);
    for (int k = 0; k < chain.inputs; ++k)
      if (streams[k])
        stream(tails.dinputs[k], dinputs[k] + i, count);
      else if (wanted[k] && !whole)
        copy(tails.dinputs[k], dinputs[k] + i, count);
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
