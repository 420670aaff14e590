#include <fieldmark/engine/ops/reduce_axes.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {

// A set of axes of a shape [a, b, c] as a mask, and the element of the result that each x[i] belongs to.
struct Reduced {
  Index size = 1;
  std::vector<Index> of;
  Reduced(const Shape& s, unsigned mask) {
    for (int k = 0; k < s.rank(); ++k)
      if (!(mask >> k & 1)) size *= s[k];
    for (Index i = 0; i < s.size(); ++i) {
      Index to = 0, stride = 1, rest = i;
      for (int k = s.rank() - 1; k >= 0; --k) {
        const Index at = rest % s[k];
        rest /= s[k];
        if (mask >> k & 1) continue;
        to += at * stride;
        stride *= s[k];
      }
      of.push_back(to);
    }
  }
};

Axes axes_of(unsigned mask) {
  std::vector<int> axes;
  for (int k = 0; k < 5; ++k)
    if (mask >> k & 1) axes.push_back(k);
  return Axes(std::span<const int>(axes));
}

}  // namespace

TEST_CASE("reduce_axes: every set of axes, as element by element") {
  const auto x = uniform({3, 2, 4, 2}, -2, 2, 1);
  for (unsigned mask = 0; mask < 16; ++mask) {
    CAPTURE(mask);
    const Reduced r(x.shape, mask);
    std::vector<double> total(at(r.size)), count = total, square = total, exps = total,
                                           largest(at(r.size), -100.0);
    for (std::size_t i = 0; i < r.of.size(); ++i) {
      const std::size_t to = at(r.of[i]);
      total[to] += x.data[i];
      exps[to] += std::exp(x.data[i]);
      ++count[to];
      largest[to] = std::max(largest[to], x.data[i]);
    }
    for (std::size_t i = 0; i < r.of.size(); ++i) {
      const std::size_t to = at(r.of[i]);
      square[to] += std::pow(x.data[i] - total[to] / count[to], 2);
    }
    Tape<double> tape;
    const auto v = tape.constant(x);
    const Axes axes = axes_of(mask);
    const auto check = [&](Var<double> got, auto want) {
      REQUIRE(got.shape().size() == r.size);
      for (std::size_t i = 0; i < total.size(); ++i)
        CHECK(got.value()[i] == Approx(want(i)).epsilon(1e-14).margin(1e-14));
    };
    check(sum(v, axes), [&](std::size_t i) { return total[i]; });
    check(mean(v, axes), [&](std::size_t i) { return total[i] / count[i]; });
    check(variance(v, axes), [&](std::size_t i) { return square[i] / count[i]; });
    check(max(v, axes), [&](std::size_t i) { return largest[i]; });
    check(logsumexp(v, axes), [&](std::size_t i) { return std::log(exps[i]); });
  }
}

TEST_CASE("reduce_axes: shapes, kept and dropped") {
  Tape<double> tape;
  const Tensor<double> x({3, 2, 4});
  const auto v = tape.constant(x);
  CHECK(sum(v, {0, 2}).shape() == Shape{2});
  CHECK(sum(v, {-1, 0}, KeepAxes::yes).shape() == Shape{1, 2, 1});
  CHECK(max(v, {0, 1, 2}).shape() == Shape{});
  CHECK(logsumexp(v, {1}, KeepAxes::yes).shape() == Shape{3, 1, 4});
  CHECK(softmax(v, 0).shape() == x.shape);
  const Tensor<double> none({3, 0});
  const auto empty = sum(tape.constant(none), {1});
  CHECK(std::vector<double>(empty.value(), empty.value() + 3) == std::vector<double>{0, 0, 0});
  const Tensor<double> no_rows({0, 3});
  CHECK(max(tape.constant(no_rows), {1}).shape() == Shape{0});
}

TEST_CASE("reduce_axes: softmax sums to one along its axis") {
  const auto x = uniform({2, 3, 4}, -3, 3, 1);
  Tape<double> tape;
  const auto total = sum(softmax(tape.constant(x), 1), {1});
  for (Index i = 0; i < 8; ++i) CHECK(total.value()[i] == Approx(1).epsilon(1e-15));
}

TEST_CASE("reduce_axes: gradient") {
  const auto x = uniform({3, 2, 4, 2}, -2, 2, 1);
  for (unsigned mask = 0; mask < 16; ++mask) {
    CAPTURE(mask);
    const Axes axes = axes_of(mask);
    for (const KeepAxes keep : {KeepAxes::no, KeepAxes::yes}) {
      expect_grad([=](auto&, auto v) { return sum(v[0], axes, keep); }, {x});
      expect_grad([=](auto&, auto v) { return mean(v[0], axes, keep); }, {x});
      expect_grad([=](auto&, auto v) { return logsumexp(v[0], axes, keep); }, {x});
    }
    expect_grad([=](auto&, auto v) { return variance(v[0], axes); }, {x});
    Tensor<double> apart(x.shape);
    for (Index i = 0; i < x.size(); ++i) apart[i] = 0.1 * static_cast<double>(i * 37 % 101);
    expect_grad([=](auto&, auto v) { return max(v[0], axes); }, {apart});
  }
  expect_grad([](auto&, auto v) { return softmax(v[0], 1); }, {x});
}

TEST_CASE("reduce_axes: of equal elements the first has the gradient of max") {
  const Tensor<double> x({2, 3}, {1, 5, 5, 2, 2, 2});
  Tape<double> tape;
  Tensor<double> g({2, 3});
  tape.backward(max(tape.leaf(x, g), {1}), std::vector<double>{1, 10});
  CHECK(g.data == std::vector<double>{0, 1, 0, 10, 0, 0});
}

TEST_CASE("reduce_axes: errors") {
  Tape<double> tape;
  const Tensor<double> x({2, 3}), none({3, 0});
  const auto v = tape.constant(x), empty = tape.constant(none);
  CHECK_THROWS_WITH(sum(v, {2}), "[sum] axes: each must be in [-2, 1], an axis of shape [2, 3], got 2");
  CHECK_THROWS_WITH(mean(v, {-3}), Contains("[mean] axes: each must be in [-2, 1]"));
  CHECK_THROWS_WITH(max(v, {1, -1}), "[max] axes: axis 1 must be named once, got it twice");
  CHECK_THROWS_WITH(mean(empty, {1}),
                    "[mean] x must have elements to reduce along the axes, got shape [3, 0]");
  CHECK_THROWS_WITH(variance(empty, {1}), Contains("[variance] x must have elements"));
  CHECK_THROWS_WITH(max(empty, {1}), Contains("[max] x must have elements"));
  CHECK_THROWS_WITH(logsumexp(empty, {1}), Contains("[logsumexp] x must have elements"));
  CHECK_THROWS_WITH(softmax(v, 2), "[softmax] axis must be in [-2, 1], an axis of shape [2, 3], got 2");
  CHECK_THROWS_AS(softmax(empty, 1), ShapeError);
  const std::vector<int> many(6);
  CHECK_THROWS_WITH(Axes(std::span<const int>(many)), "[axes] a shape has at most 5 axes, got 6");
}

TEST_CASE("reduce_axes: same bits for any thread count") {
  const auto tall = uniform<float>({200001, 3}, -1, 1, 1), wide = uniform<float>({3, 200001}, -1, 1, 2);
  for (const int axis : {0, 1}) {
    CAPTURE(axis);
    for (const auto& x : {tall, wide}) {
      expect_same_bits([=](auto&, auto v) { return sum(v[0], {axis}); }, {x});
      expect_same_bits([=](auto&, auto v) { return variance(v[0], {axis}); }, {x});
      expect_same_bits([=](auto&, auto v) { return max(v[0], {axis}); }, {x});
      expect_same_bits([=](auto&, auto v) { return logsumexp(v[0], {axis}); }, {x});
    }
  }
}
