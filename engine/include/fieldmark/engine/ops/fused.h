#pragma once
#include <fieldmark/engine/chain.h>
#include <fieldmark/engine/tape.h>

#include <array>
#include <type_traits>
#include <utility>

namespace fieldmark {

namespace detail {
template <class T>
Var<T> run_chain(const Chain& chain, std::span<const Var<T>> inputs, std::source_location from);
}  // namespace detail

/// Applies f to each element in one pass over memory, forward and backward, however many steps f has:
///   y[i] = f(x_0[i], x_1[i], ...)
/// The result is recorded as one op. Blocks of elements stay in the L1 cache from step to step; the backward
/// recomputes intermediate values instead of reading them.
///
/// @code
/// auto y = fused([](auto x, auto gain, auto bias) { return x * sigmoid(gain * x + bias); }, x, gain, bias);
/// @endcode
/// @param f  called once with a Lane for each input; returns a Lane. See chain.h for what it may do. A
/// generic lambda serves Lane and Var alike.
/// @param first, rest  1 to Chain::kMaxInputs inputs, whose shapes broadcast
/// @throws ShapeError if they do not   @throws ValueError if f has too many steps, or an input was recorded
/// on another tape
template <class T, class F, class... Rest>
requires(std::is_same_v<Rest, Var<T>>&&...) Var<T> fused(F f, Var<T> first, Rest... rest) {
  constexpr std::size_t n = 1 + sizeof...(Rest);
  static_assert(n <= Chain::kMaxInputs, "fused: too many inputs");
  const std::array<Var<T>, n> inputs{first, rest...};
  Chain chain(static_cast<int>(n));
  [&]<std::size_t... k>(std::index_sequence<k...>) { chain.finish(f(chain.input(static_cast<int>(k))...)); }
  (std::make_index_sequence<n>{});
  return detail::run_chain<T>(chain, inputs, std::source_location::current());
}

}  // namespace fieldmark
