#include <fieldmark/engine/ops/layout.h>

#include <limits>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_permute = [](auto&, auto v) { return permute(v[0], {2, 0, -2}); };
static const auto f_transpose = [](auto&, auto v) { return transpose(v[0]); };
static const auto f_broadcast_to = [](auto&, auto v) { return broadcast_to(v[0], {2, 5, 3}); };
static const auto f_pad = [](auto&, auto v) { return pad(v[0], -2, 1, 2, 9); };
static const auto f_cumsum = [](auto&, auto v) { return cumsum(v[0], 0); };

TEST_CASE("layout: values") {
  const std::vector<Tensor<double>> in{{{2, 3}, {1, 2, 3, 4, 5, 6}}};
  CHECK(op_values(f_transpose, in) == std::vector<double>{1, 4, 2, 5, 3, 6});
  CHECK(op_values([](auto&, auto v) { return reshape(v[0], {3, 2}); }, in) == in[0].data);
  CHECK(op_values(f_pad, in) == std::vector<double>{9, 9, 9, 1, 2, 3, 4, 5, 6, 9, 9, 9, 9, 9, 9});
  CHECK(op_values([](auto&, auto v) { return pad(v[0], 1, 1, 0); }, in) ==
        std::vector<double>{0, 1, 2, 3, 0, 4, 5, 6});
  CHECK(op_values(f_cumsum, in) == std::vector<double>{1, 2, 3, 5, 7, 9});
  CHECK(op_values([](auto&, auto v) { return cumsum(v[0]); }, in) == std::vector<double>{1, 3, 6, 4, 9, 15});
  CHECK(op_values(
            [](auto&, auto v) {
              return broadcast_to(v[0], {2, 2, 3});
            },
            in) == std::vector<double>{1, 2, 3, 4, 5, 6, 1, 2, 3, 4, 5, 6});
  Tape<double> tape;
  Tensor<double> g({2, 3});
  CHECK_FALSE(detach(tape.leaf(in[0], g)).needs_grad());
}

TEST_CASE("layout: permute moves every element of five axes") {
  const auto x = uniform({2, 3, 4, 5, 2}, -1, 1, 1);
  Tape<double> tape;
  const auto y = permute(tape.constant(x), {3, 1, 4, 0, 2});
  REQUIRE(y.shape() == Shape{5, 3, 2, 2, 4});
  Index at = 0;
  bool same = true;
  for (Index d = 0; d < 5; ++d)
    for (Index b = 0; b < 3; ++b)
      for (Index e = 0; e < 2; ++e)
        for (Index a = 0; a < 2; ++a)
          for (Index c = 0; c < 4; ++c)
            same = same && y.value()[at++] == x[(((a * 3 + b) * 4 + c) * 5 + d) * 2 + e];
  CHECK(same);
}

TEST_CASE("layout: gradient") {
  for (Shape s : {Shape{0, 2, 1}, Shape{1, 1, 1}, Shape{3, 2, 4}}) {
    CAPTURE(s.str());
    expect_grad(f_permute, {uniform(s, -1, 1, 1)});
    expect_grad(f_transpose, {uniform(s, -1, 1, 1)});
    expect_grad(f_pad, {uniform(s, -1, 1, 1)});
    expect_grad(f_cumsum, {uniform(s, -1, 1, 1)});
  }
  for (Shape s : {Shape{}, Shape{3}, Shape{5, 1}, Shape{2, 1, 1}, Shape{2, 1, 3}})
    expect_grad(f_broadcast_to, {uniform(s, -1, 1, 1)});
  expect_grad([](auto&, auto v) { return permute(v[0], std::span<const int>()); }, {uniform({}, -1, 1, 1)});
}

TEST_CASE("layout: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3});
  const auto x = tape.constant(a);
  CHECK_THROWS_WITH(reshape(x, {4}), Contains("[reshape] shape must have the 6 elements of x"));
  CHECK_THROWS_WITH(permute(x, {0}),
                    "[permute] order must have the 2 axes of x, whose shape is [2, 3], got 1");
  CHECK_THROWS_WITH(permute(x, {0, 2}), "[permute] order must be in [-2, 1], an axis of shape [2, 3], got 2");
  CHECK_THROWS_WITH(permute(x, {0, -2}), "[permute] order: axis 0 must be named once, got it twice");
  CHECK_THROWS_WITH(transpose(x, 0, -3), "[transpose] b must be in [-2, 1], an axis of shape [2, 3], got -3");
  CHECK_THROWS_WITH(broadcast_to(x, {2, 4}),
                    "[broadcast_to] x must have extents of shape [2, 4] or 1, counted "
                    "from the last axis, got shape [2, 3]");
  CHECK_THROWS_AS(broadcast_to(x, {3}), ShapeError);
  CHECK_THROWS_AS(broadcast_to(x, {2, 1}), ShapeError);
  CHECK_THROWS_WITH(pad(x, 2, 1, 1), Contains("[pad] axis must be in [-2, 1]"));
  CHECK_THROWS_WITH(pad(x, 1, -1, 1), "[pad] before and after must be 0 or more, got -1 and 1");
  const Index huge = Index{1} << 62;
  CHECK_THROWS_WITH(pad(x, 1, huge, huge),
                    "[pad] before and after must leave fewer than 2^60 elements of the result, got "
                    "4611686018427387904 and 4611686018427387904 for shape [2, 3]");
  CHECK_THROWS_AS(pad(x, 0, huge, 0), ValueError);
  CHECK_THROWS_AS(pad(x, 0, 0, std::numeric_limits<Index>::max()), ValueError);
  CHECK_THROWS_WITH(cumsum(x, 5), Contains("[cumsum] axis must be in [-2, 1]"));
}

TEST_CASE("layout: same bits for any thread count") {
  const auto x = uniform<float>({31, 47, 73}, -1, 1, 1);
  expect_same_bits(f_permute, {x});
  expect_same_bits(f_pad, {x});
  expect_same_bits(f_cumsum, {x});
  expect_same_bits(
      [](auto&, auto v) {
        return broadcast_to(v[0], {300, 500, 3});
      },
      {uniform<float>({500, 1}, -1, 1, 1)});
}
