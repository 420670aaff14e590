#include <fieldmark/engine/ops/layer_norm.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_layer_norm = [](auto&, auto v) { return layer_norm(v[0], v[1], v[2], 0.01); };

TEST_CASE("layer_norm: values") {
  const std::vector<Tensor<double>> in{
      {{2, 4}, {1, 2, 3, 6, 5, 5, 5, 5}}, {{4}, {1, 2, 1, 1}}, {{4}, {0, 0, 7, 1}}};
  const auto y = op_values(f_layer_norm, in);
  const double r = 1 / std::sqrt((4 + 1 + 0 + 9) / 4.0 + 0.01);
  const std::vector<double> want{-2 * r, -2 * r, 7, 3 * r + 1, 0, 0, 7, 1};
  for (std::size_t i = 0; i < 8; ++i) CHECK(y[i] == Approx(want[i]).margin(1e-15));
}

TEST_CASE("layer_norm: gradient") {
  for (Shape s : {Shape{0, 3}, Shape{3}, Shape{1, 3}, Shape{2, 4, 3}})
    expect_grad(f_layer_norm, {uniform(s, -1, 1, 1), uniform({3}, -1, 1, 2), uniform({3}, -1, 1, 3)});
  expect_grad(f_layer_norm, {uniform({2, 1}, -1, 1, 1), uniform({1}, -1, 1, 2), uniform({1}, -1, 1, 3)});
}

TEST_CASE("layer_norm: float against double for extents of 1 to 130") {
  CHECK(float_error_to_130(f_layer_norm, [](Index e) {
          return std::vector{uniform<float>({3, e}, -1, 1, 1), uniform<float>({e}, -1, 1, 2),
                             uniform<float>({e}, -1, 1, 3)};
        }) < 1e-6);
}

TEST_CASE("layer_norm: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), c({3}), d({4}), none({2, 0});
  const auto x = tape.constant(a), g = tape.constant(c), wrong = tape.constant(d);
  CHECK_THROWS_WITH(layer_norm(x, wrong, g),
                    "[layer_norm] gamma: axis 0 must be 3 (columns of x), got shape [4]");
  CHECK_THROWS_WITH(layer_norm(x, g, x), Contains("[layer_norm] beta must have rank 1 [columns]"));
  CHECK_THROWS_WITH(layer_norm(x, g, g, 0), Contains("[layer_norm] eps must be above 0"));
  CHECK_THROWS_WITH(layer_norm(tape.constant(none), g, g),
                    Contains("x must have at least one column [.., C]"));
}

TEST_CASE("layer_norm: same bits for any thread count") {
  expect_same_bits(f_layer_norm, {uniform<float>({3001, 33}, -1, 1, 1), uniform<float>({33}, -1, 1, 2),
                                  uniform<float>({33}, -1, 1, 3)});
}
