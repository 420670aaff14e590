#include <fieldmark/engine/ops/slice.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_concat = [](auto&, auto v) { return concatenate(v); };
static const auto f_slice = [](auto&, auto v) { return slice(v[0], 1, 2); };

TEST_CASE("slice: values, and of concatenate") {
  const std::vector<Tensor<double>> in{
      {{2, 1}, {1, 2}}, {{2, 3}, {10, 11, 12, 20, 21, 22}}, Tensor<double>({2, 0})};
  CHECK(op_values(f_concat, in) == std::vector<double>{1, 10, 11, 12, 2, 20, 21, 22});
  CHECK(op_values(f_slice, std::vector{in[1]}) == std::vector<double>{11, 12, 21, 22});
  Tape<double> tape;
  const Tensor<double> a({2, 3, 4, 1}), b({2, 3, 4, 5});
  CHECK(concatenate({tape.constant(a), tape.constant(b)}).shape() == Shape{2, 3, 4, 6});
  CHECK(slice(tape.constant(b), 0, 0).shape() == Shape{2, 3, 4, 0});
}

TEST_CASE("slice: concatenate takes vectors and braced lists alike") {
  Tape<double> tape;
  const Tensor<double> a({2, 1}, {1, 2}), b({2, 1}, {3, 4});
  const std::vector<Var<double>> xs{tape.constant(a), tape.constant(b)};
  const auto values = [](Var<double> v) {
    return std::vector<double>(v.value(), v.value() + v.shape().size());
  };
  CHECK(values(concatenate(xs)) == std::vector<double>{1, 3, 2, 4});
  CHECK(values(concatenate({xs[0], xs[1]})) == std::vector<double>{1, 3, 2, 4});
  CHECK(values(concatenate(xs, 0)) == std::vector<double>{1, 2, 3, 4});
  CHECK(values(concatenate({xs[0], xs[1]}, 0)) == std::vector<double>{1, 2, 3, 4});
  CHECK_THROWS_AS(concatenate(std::vector<Var<double>>{}), ValueError);
}

TEST_CASE("slice: gradient") {
  for (Index n : {0, 1, 4}) {
    CAPTURE(n);
    expect_grad(f_concat, {uniform({n, 2}, -1, 1, 1), uniform({n, 1}, -1, 1, 2), uniform({n, 3}, -1, 1, 3)});
    expect_grad(f_slice, {uniform({n, 4}, -1, 1, 1)});
  }
  expect_grad(
      [](Tape<double>&, std::span<const Var<double>> v) {
        return concatenate({v[0], v[0]});
      },
      {uniform({3, 2}, -1, 1, 1)});
}

TEST_CASE("slice: float copies, forward and backward, for extents of 1 to 130") {
  CHECK(float_error_to_130(f_concat, [](Index e) {
          return std::vector{uniform<float>({3, e}, -1, 1, 1), uniform<float>({3, 131 - e}, -1, 1, 2)};
        }) < 6e-8);  // rounding of the cotangent itself
  CHECK(float_error_to_130(f_slice, [](Index e) {
          return std::vector{uniform<float>({3, e + 2}, -1, 1, 1)};
        }) < 6e-8);
}

TEST_CASE("slice: any axis") {
  const std::vector<Tensor<double>> in{{{2, 2, 2}, {1, 2, 3, 4, 5, 6, 7, 8}}, {{2, 1, 2}, {10, 20, 30, 40}}};
  CHECK(op_values([](auto&, auto v) { return slice(v[0], 1, 1, 1); }, in) == std::vector<double>{3, 4, 7, 8});
  CHECK(op_values([](auto&, auto v) { return slice(v[0], -3, 1, 1); }, in) ==
        std::vector<double>{5, 6, 7, 8});
  CHECK(op_values(
            [](auto&, auto v) {
              return concatenate({v[1], v[0]}, 1);
            },
            in) == std::vector<double>{10, 20, 1, 2, 3, 4, 30, 40, 5, 6, 7, 8});
  CHECK(op_values(
            [](auto&, auto v) {
              return concatenate({v[1], v[1]}, 0);
            },
            in) == std::vector<double>{10, 20, 30, 40, 10, 20, 30, 40});
  expect_grad([](auto&, auto v) { return slice(v[0], 1, 0, 1); }, {in[0]});
  expect_grad([](auto&, auto v) { return concatenate({v[0], v[1], v[0]}, 1); }, in);
}

TEST_CASE("slice: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), b({3, 3}), scalar(Shape{});
  CHECK_THROWS_WITH(
      concatenate({tape.constant(a), tape.constant(b)}),
      "[concatenate] xs: all axes but the last must be those of the first, [2, 3], got shape [3, 3]");
  CHECK_THROWS_WITH(concatenate(std::span<const Var<double>>()), Contains("at least one tensor, got 0"));
  CHECK_THROWS_WITH(slice(tape.constant(a), 2, 2),
                    Contains("entries 2 to 4 must lie within") && Contains("[2, 3]"));
  CHECK_THROWS_AS(slice(tape.constant(a), -1, 2), ShapeError);
  CHECK_THROWS_WITH(slice(tape.constant(a), 2, 0, 1),
                    "[slice] axis must be in [-2, 1], an axis of shape [2, 3], got 2");
  CHECK_THROWS_WITH(slice(tape.constant(a), 0, 1, 2),
                    "[slice] begin and count: entries 1 to 3 must lie within axis 0 of x, got shape [2, 3]");
  CHECK_THROWS_WITH(concatenate({tape.constant(a), tape.constant(scalar)}, 0),
                    "[concatenate] xs: all axes but axis 0 must be those of the first, [2, 3], got shape []");
  CHECK_THROWS_WITH(concatenate({tape.constant(a), tape.constant(a)}, -3),
                    Contains("axis must be in [-2, 1]"));
  CHECK_THROWS_WITH(slice(tape.constant(scalar), 0, 1),
                    Contains("must have rank 1 or more [.., C], got shape []"));
}

TEST_CASE("slice: same bits for any thread count") {
  expect_same_bits(f_concat, {uniform<float>({20000, 3}, -1, 1, 1), uniform<float>({20000, 4}, -1, 1, 2)});
  expect_same_bits(f_slice, {uniform<float>({40000, 4}, -1, 1, 1)});
}
