#include <fieldmark/engine/ops/arithmetic.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_add = [](auto&, auto v) { return add(v[0], v[1]); };
static const auto f_sub = [](auto&, auto v) { return sub(v[0], v[1]); };
static const auto f_mul = [](auto&, auto v) { return mul(v[0], v[1]); };
static const auto f_scale = [](auto&, auto v) { return scale(v[0], -2.5); };

TEST_CASE("arithmetic: values") {
  const std::vector<Tensor<float>> in{{{2, 2}, {1, -2, 3, 0.5f}}, {{2, 2}, {4, 8, -1, 0}}};
  CHECK(op_values(f_add, in) == std::vector<float>{5, 6, 2, 0.5f});
  CHECK(op_values(f_sub, in) == std::vector<float>{-3, -10, 4, 0.5f});
  CHECK(op_values(f_mul, in) == std::vector<float>{4, -16, -3, 0});
  CHECK(op_values(f_scale, in) == std::vector<float>{-2.5f, 5, -7.5f, -1.25f});
}

TEST_CASE("arithmetic: gradient") {
  for (Shape s : {Shape{0}, Shape{1}, Shape{3, 5}}) {
    CAPTURE(s.str());
    expect_grad(f_add, {uniform(s, -1, 1, 1), uniform(s, -1, 1, 2)});
    expect_grad(f_sub, {uniform(s, -1, 1, 1), uniform(s, -1, 1, 2)});
    expect_grad(f_mul, {uniform(s, -1, 1, 1), uniform(s, -1, 1, 2)});
    expect_grad(f_scale, {uniform(s, -1, 1, 1)});
  }
}

TEST_CASE("arithmetic: gradient where both sides are one value") {
  expect_grad([](Tape<double>&, std::span<const Var<double>> v) { return sub(mul(v[0], v[0]), v[0]); },
              {uniform({7}, -1, 1, 3)});
}

TEST_CASE("arithmetic: float against double for extents of 1 to 130") {
  const auto pairs = [](Index e) {
    return std::vector{uniform<float>({e}, -1, 1, 1), uniform<float>({e}, -1, 1, 2)};
  };
  CHECK(float_error_to_130(f_add, pairs) < 1.2e-7);
  CHECK(float_error_to_130(f_sub, pairs) < 1.2e-7);
  CHECK(float_error_to_130(f_mul, pairs) < 1.2e-7);
  CHECK(float_error_to_130(f_scale, [&](Index e) { return std::vector{pairs(e)[0]}; }) < 1.2e-7);
}

TEST_CASE("arithmetic: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), b({3, 2});
  const auto x = tape.constant(a), y = tape.constant(b);
  CHECK_THROWS_WITH(add(x, y), "[add] b must have the shape of a, [2, 3], got shape [3, 2]");
  CHECK_THROWS_WITH(sub(x, y), "[sub] b must have the shape of a, [2, 3], got shape [3, 2]");
  CHECK_THROWS_WITH(mul(x, y), "[mul] b must have the shape of a, [2, 3], got shape [3, 2]");
}

TEST_CASE("arithmetic: same bits for any thread count") {
  const std::vector<Tensor<float>> in{uniform<float>({100001}, -1, 1, 1), uniform<float>({100001}, -1, 1, 2)};
  expect_same_bits(f_add, in);
  expect_same_bits(f_sub, in);
  expect_same_bits(f_mul, in);
  expect_same_bits(f_scale, {in[0]});
}
