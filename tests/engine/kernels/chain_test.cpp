#include "kernels/chain.h"

#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/chain.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"

namespace fieldmark::kernels {
namespace {

using detail::ChainOp, detail::ChainSteps;
template <class T>
using Arrays = std::vector<AlignedVector<T>>;

constexpr std::size_t kInputs = detail::kChainInputs, kValues = kInputs + detail::kChainSteps;

// Steps of random ops on recent and older values; operands are often one value. Some chains are as long as
// can be.
ChainSteps random_chain(std::mt19937& rng) {
  const auto below = [&](int n) { return static_cast<int>(rng() % static_cast<unsigned>(n)); };
  ChainSteps c{.inputs = 1 + below(3), .count = 1 + below(9), .step = {}};
  if (below(10) == 0)
    c = {.inputs = detail::kChainInputs, .count = detail::kChainSteps - below(3), .step = {}};
  for (int s = 0; s < c.count; ++s) {
    const int have = c.inputs + s;
    const auto pick = [&] {
      return static_cast<std::uint8_t>(below(2) ? have - 1 - below(std::min(have, 3)) : below(have));
    };
    const auto op = static_cast<ChainOp>(below(2) ? below(7) : below(18));
    const std::uint8_t a = pick(), b = op <= ChainOp::maximum ? pick() : a;
    c.step[s] = {op, a, b, 0.7 * below(5) + 0.3, below(5) - 1.7};
  }
  return c;
}

// One element of one step, as a chain of its own: no pass has a neighbour.
template <class T>
struct Step {
  ChainSteps chain;
  bool one;  // both operands are one value

  explicit Step(const detail::ChainStep& s) : chain{.inputs = 2, .count = 1, .step = {s}}, one(s.a == s.b) {
    chain.step[0].a = 0;
    chain.step[0].b = one ? 0 : 1;
  }
  T value(T a, T b) const {
    const T* inputs[] = {&a, &b};
    T y = 0;
    FIELDMARK_KERNEL(chain_forward<T>)(chain, inputs, &y, 1, false);
    return y;
  }
  void gradient(T a, T b, T g, T* da, T* db, const bool* add) const {
    const T* inputs[] = {&a, &b};
    T* to[] = {da, one || chain.step[0].op > ChainOp::maximum ? nullptr : db};
    FIELDMARK_KERNEL(chain_backward<T>)(chain, inputs, &g, to, add, 1, false);
  }
};

// The value of a chain and the gradients of its inputs at one element, step by step.
template <class T>
T by_steps(const ChainSteps& c, T* value, T dy, T* grad, bool* reached) {
  for (int s = 0; s < c.count; ++s)
    value[c.inputs + s] = Step<T>(c.step[s]).value(value[c.step[s].a], value[c.step[s].b]);
  const int result = c.inputs + c.count - 1;
  grad[result] = dy;
  reached[result] = true;
  for (int s = c.count - 1; s >= 0; --s) {
    const auto& step = c.step[s];
    if (!reached[c.inputs + s]) continue;
    const bool add[] = {reached[step.a], reached[step.b]};
    Step<T>(step).gradient(value[step.a], value[step.b], grad[c.inputs + s], grad + step.a, grad + step.b,
                           add);
    reached[step.a] = reached[step.b] = true;
  }
  return value[result];
}

template <class T>
bool same(T x, T y) {
  return std::memcmp(&x, &y, sizeof x) == 0 || (std::isnan(x) && std::isnan(y));
}

template <class T>
Arrays<T> numbers_and_specials(std::size_t n, std::mt19937& rng) {
  using Limits = std::numeric_limits<T>;
  const T special[] = {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(), 0};
  Arrays<T> all(kInputs + 1, AlignedVector<T>(n));
  for (auto& array : all)
    for (T& x : array) x = rng() % 12 ? static_cast<T>(rng() % 4001) / 700 - 2 : special[rng() % 4];
  return all;
}

template <class T>
void expect_as_by_steps(unsigned seed) {
  std::mt19937 rng(seed);
  const ChainSteps c = random_chain(rng);
  const std::size_t from = 16, n = 8 * 64 / sizeof(T) + 3 * 64 / sizeof(T) + 1 + seed % 5;
  const bool large = seed % 2 == 0;
  const Arrays<T> in = numbers_and_specials<T>(from + n, rng);
  Arrays<T> grads(kInputs, AlignedVector<T>(from + n, T(0.3)));
  AlignedVector<T> y(from + n);
  const T* inputs[kInputs];
  T* dinputs[kInputs];
  bool add[kInputs], wrong = false;
  for (std::size_t k = 0; k < kInputs; ++k) {
    inputs[k] = in[k].data() + from;
    dinputs[k] = grads[k].data() + from;
    add[k] = rng() % 2 == 0;
  }
  const auto size = static_cast<Index>(n);
  FIELDMARK_KERNEL(chain_forward<T>)(c, inputs, y.data() + from, size, large);
  FIELDMARK_KERNEL(chain_backward<T>)(c, inputs, in[kInputs].data() + from, dinputs, add, size, large);
  for (std::size_t i = 0; i < n; ++i) {
    T value[kValues], grad[kValues] = {};
    bool reached[kValues] = {};
    std::copy_n(add, c.inputs, reached);
    std::fill_n(grad, c.inputs, T(0.3));
    for (int k = 0; k < c.inputs; ++k) value[k] = inputs[k][i];
    wrong |= !same(by_steps(c, value, in[kInputs][from + i], grad, reached), y[from + i]);
    for (int k = 0; k < c.inputs; ++k) wrong |= !same(grad[k], dinputs[k][i]);
  }
  CAPTURE(seed, sizeof(T), c.count);
  CHECK(!wrong);
}

}  // namespace

// Passes hand their results on in registers: whichever are neighbours, bits are those of the steps alone.
TEST_CASE("kernels/chain: bits of random chains as of their steps one by one, with NaN and infinity") {
  each_isa([&] {
    for (unsigned seed = 0; seed < 150; ++seed) {
      expect_as_by_steps<float>(seed);
      expect_as_by_steps<double>(seed);
    }
  });
}

TEST_CASE(
    "kernels/chain: every length at an odd offset, and past the caches, and nothing outside is touched") {
  Chain chain(2);
  chain.finish(chain.input(0) * chain.input(1) + 2.0 * chain.input(0));
  each_isa([&] {
    for (const auto& [large, from] : {std::pair{false, 1u}, std::pair{true, 16u}})
      for (std::int64_t n = 0; n <= 530; n = n < 70 ? n + 1 : n + 51) {
        CAPTURE(n, large);
        const auto size = static_cast<std::size_t>(n);
        const auto a = uniform<float>({n + from}, -1, 1, 1), b = uniform<float>({n + from}, -1, 1, 2),
                   dy = uniform<float>({n + from}, -1, 1, 3);
        AlignedVector<float> y(size + from + 1, 7.f), da = y, db = y;
        const float* inputs[] = {a.data.data() + from, b.data.data() + from};
        float* dinputs[] = {da.data() + from, db.data() + from};
        const bool add[] = {false, true};
        FIELDMARK_KERNEL(chain_forward<float>)(chain.steps(), inputs, y.data() + from, n, large);
        FIELDMARK_KERNEL(chain_backward<float>)
        (chain.steps(), inputs, dy.data.data() + from, dinputs, add, n, large);
        for (const auto* array : {&y, &da, &db}) CHECK(((*array)[from - 1] == 7 && array->back() == 7));
        for (std::size_t i = from; i < size + from; ++i) {
          CHECK(std::abs(y[i] - (a.data[i] * b.data[i] + 2 * a.data[i])) <= 1e-6f);
          CHECK(std::abs(da[i] - dy.data[i] * (b.data[i] + 2)) <= 1e-6f);
          CHECK(std::abs(db[i] - (7 + dy.data[i] * a.data[i])) <= 2e-6f);
        }
      }
  });
}

// y = t^2 + (x + x), t = (x - w) + (x + b): sums pass their gradient on, x has its gradient in four parts.
TEST_CASE("kernels/chain: gradients in several parts, through sums and differences") {
  Chain chain(3);
  const auto x = chain.input(0), w = chain.input(1), b = chain.input(2), t = (x - w) + (x + b);
  chain.finish(t * t + (x + x));
  constexpr std::size_t n = 300, from = 16;
  each_isa([&] {
    for (const bool large : {false, true})
      for (const bool add_x : {false, true}) {
        CAPTURE(large, add_x);
        std::vector<Tensor<float>> values;
        for (const int seed : {1, 2, 3, 4}) values.push_back(uniform<float>({from + n}, -1, 1, seed));
        std::vector<AlignedVector<float>> grads(3, AlignedVector<float>(from + n, 7.f));
        const float* inputs[3];
        float* dinputs[3];
        for (std::size_t k = 0; k < 3; ++k)
          inputs[k] = values[k].data.data() + from, dinputs[k] = grads[k].data() + from;
        const bool add[] = {add_x, false, false};
        FIELDMARK_KERNEL(chain_backward<float>)
        (chain.steps(), inputs, values[3].data.data() + from, dinputs, add, n, large);
        for (std::size_t i = 0; i < n; ++i) {
          const double dt = 2.0 * (2.0 * inputs[0][i] - inputs[1][i] + inputs[2][i]),
                       dy = values[3].data[from + i];
          CHECK(std::abs(dinputs[0][i] - ((add_x ? 7 : 0) + dy * (2 * dt + 2))) <= 1e-5);
          CHECK(std::abs(dinputs[1][i] + dy * dt) <= 4e-6);
          CHECK(std::abs(dinputs[2][i] - dy * dt) <= 4e-6);
        }
      }
  });
}

TEST_CASE("kernels/chain: a gradient that is not wanted has no memory") {
  Chain chain(2);
  chain.finish(chain.input(0) / chain.input(1));
  const double a[] = {6}, b[] = {2}, dy[] = {1};
  const double* inputs[] = {a, b};
  double da = 1, *dinputs[] = {&da, nullptr};
  const bool add[] = {true, false};
  FIELDMARK_KERNEL(chain_backward<double>)(chain.steps(), inputs, dy, dinputs, add, 1, false);
  CHECK(da == 1.5);
}

}  // namespace fieldmark::kernels
