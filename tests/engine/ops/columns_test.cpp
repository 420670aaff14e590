#include <fieldmark/engine/ops/columns.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_concat = [](auto&, auto v) { return concat_columns(v); };
static const auto f_columns = [](auto&, auto v) { return columns(v[0], 1, 2); };

TEST_CASE("columns: values") {
  const std::vector<Tensor<double>> in{
      {{2, 1}, {1, 2}}, {{2, 3}, {10, 11, 12, 20, 21, 22}}, Tensor<double>({2, 0})};
  CHECK(op_values(f_concat, in) == std::vector<double>{1, 10, 11, 12, 2, 20, 21, 22});
  CHECK(op_values(f_columns, std::vector{in[1]}) == std::vector<double>{11, 12, 21, 22});
  Tape<double> tape;
  const Tensor<double> a({2, 3, 4, 1}), b({2, 3, 4, 5});
  CHECK(concat_columns({tape.constant(a), tape.constant(b)}).shape() == Shape{2, 3, 4, 6});
  CHECK(columns(tape.constant(b), 0, 0).shape() == Shape{2, 3, 4, 0});
}

TEST_CASE("columns: gradient") {
  for (Index n : {0, 1, 4}) {
    CAPTURE(n);
    expect_grad(f_concat, {uniform({n, 2}, -1, 1, 1), uniform({n, 1}, -1, 1, 2), uniform({n, 3}, -1, 1, 3)});
    expect_grad(f_columns, {uniform({n, 4}, -1, 1, 1)});
  }
  expect_grad(
      [](Tape<double>&, std::span<const Var<double>> v) {
        return concat_columns({v[0], v[0]});
      },
      {uniform({3, 2}, -1, 1, 1)});
}

TEST_CASE("columns: float copies, forward and backward, for extents of 1 to 130") {
  CHECK(float_error_to_130(f_concat, [](Index e) {
          return std::vector{uniform<float>({3, e}, -1, 1, 1), uniform<float>({3, 131 - e}, -1, 1, 2)};
        }) < 6e-8);  // the cotangent's own rounding
  CHECK(float_error_to_130(f_columns, [](Index e) {
          return std::vector{uniform<float>({3, e + 2}, -1, 1, 1)};
        }) < 6e-8);
}

TEST_CASE("columns: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), b({3, 3}), scalar(Shape{});
  CHECK_THROWS_WITH(
      concat_columns({tape.constant(a), tape.constant(b)}),
      "[concat_columns] xs: all axes but the last must be those of the first, [2, 3], got shape [3, 3]");
  CHECK_THROWS_WITH(concat_columns(std::span<const Var<double>>()), Contains("at least one tensor, got 0"));
  CHECK_THROWS_WITH(columns(tape.constant(a), 2, 2),
                    Contains("columns 2 to 4 must lie within") && Contains("[2, 3]"));
  CHECK_THROWS_AS(columns(tape.constant(a), -1, 2), ShapeError);
  CHECK_THROWS_WITH(columns(tape.constant(scalar), 0, 1),
                    Contains("must have rank 1 or more [.., C], got shape []"));
}

TEST_CASE("columns: same bits for any thread count") {
  expect_same_bits(f_concat, {uniform<float>({20000, 3}, -1, 1, 1), uniform<float>({20000, 4}, -1, 1, 2)});
  expect_same_bits(f_columns, {uniform<float>({40000, 4}, -1, 1, 1)});
}
