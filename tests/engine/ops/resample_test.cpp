#include <fieldmark/engine/ops/resample.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {
const auto f_double = [](auto&, auto v) { return upsample_nearest(v[0], 2); };
const auto f_depth = [](auto&, auto v) { return space_to_depth(v[0]); };
auto to(Index h, Index w, Interpolation mode = Interpolation::bilinear) {
  return [=](auto&, auto v) { return upsample_to(v[0], h, w, mode); };
}
}  // namespace

TEST_CASE("resample: nearest repeats pixels") {
  const std::vector<Tensor<double>> x{{{1, 2, 2, 1}, {1, 2, 3, 4}}};
  CHECK(op_values(f_double, x) == std::vector<double>{1, 1, 2, 2, 1, 1, 2, 2, 3, 3, 4, 4, 3, 3, 4, 4});
  CHECK(op_values(to(3, 1, Interpolation::nearest), x) == std::vector<double>{2, 4, 4});
}

TEST_CASE("resample: bilinear values") {
  const std::vector<Tensor<double>> row{{{1, 1, 2, 1}, {0, 8}}}, square{{{1, 2, 2, 1}, {0, 4, 8, 20}}};
  CHECK(op_values(to(1, 4), row) == std::vector<double>{0, 2, 6, 8});
  CHECK(op_values(to(1, 1), row) == std::vector<double>{4});
  CHECK(op_values(to(2, 2), square) == square[0].data);  // the same size is the identity
  CHECK(op_values(to(1, 1), square) == std::vector<double>{8});
  CHECK(op_values(to(4, 4), square)[5] == 0.75 * (0.75 * 0 + 0.25 * 4) + 0.25 * (0.75 * 8 + 0.25 * 20));
  // A linear ramp stays linear between the outermost centres.
  Tensor<double> ramp({1, 5, 7, 2});
  for (Index i = 0; i < 5; ++i)
    for (Index j = 0; j < 7; ++j)
      for (Index c = 0; c < 2; ++c) ramp[(i * 7 + j) * 2 + c] = 3.0 * double(i) - 2.0 * double(j) + double(c);
  const auto y = op_values(to(11, 13), std::vector{ramp});
  for (Index i = 1; i < 10; ++i)
    for (Index j = 1; j < 12; ++j) {
      const double u = (double(i) + 0.5) * 5 / 11 - 0.5, v = (double(j) + 0.5) * 7 / 13 - 0.5;
      CHECK(std::abs(y[static_cast<std::size_t>((i * 13 + j) * 2)] - (3 * u - 2 * v)) < 1e-13);
    }
}

TEST_CASE("resample: space_to_depth is the stated permutation") {
  Tensor<double> x({2, 4, 6, 3});
  for (Index i = 0; i < x.size(); ++i) x[i] = double(i);
  const auto y = op_values(f_depth, std::vector{x});
  for (Index n = 0; n < 2; ++n)
    for (Index i = 0; i < 4; ++i)
      for (Index j = 0; j < 6; ++j)
        for (Index c = 0; c < 3; ++c) {
          const Index channel = (2 * (i % 2) + j % 2) * 3 + c;
          CHECK(y[static_cast<std::size_t>(((n * 2 + i / 2) * 3 + j / 2) * 12 + channel)] ==
                x[((n * 4 + i) * 6 + j) * 3 + c]);
        }
}

TEST_CASE("resample: gradient") {
  for (Shape s : {Shape{0, 2, 2, 2}, Shape{1, 1, 1, 1}, Shape{2, 3, 4, 2}}) {
    CAPTURE(s.str());
    for (auto mode : {Interpolation::nearest, Interpolation::bilinear}) {
      expect_grad(to(7, 5, mode), {uniform(s, -1, 1, 1)});
      expect_grad(to(2, 3, mode), {uniform(s, -1, 1, 1)});
      expect_grad(to(0, 3, mode), {uniform(s, -1, 1, 1)});
    }
    expect_grad(f_double, {uniform(s, -1, 1, 1)});
  }
  expect_grad(f_depth, {uniform({2, 4, 2, 3}, -1, 1, 1)});
  expect_grad(f_depth, {uniform({1, 0, 2, 3}, -1, 1, 1)});
}

TEST_CASE("resample: errors") {
  Tape<double> tape;
  const Tensor<double> x({1, 2, 3, 1}), flat({4, 3}), none({1, 0, 3, 1});
  CHECK_THROWS_WITH(upsample_nearest(tape.constant(flat), 2),
                    Contains("[upsample_nearest] x must have rank 4"));
  CHECK_THROWS_WITH(upsample_nearest(tape.constant(x), 0), Contains("factor must be at least 1, got 0"));
  CHECK_THROWS_WITH(upsample_to(tape.constant(x), 3, -1), Contains("must be 0 or more, got 3 and -1"));
  CHECK_THROWS_WITH(upsample_to(tape.constant(none), 3, 3),
                    Contains("at least one pixel, got shape [1, 0, 3, 1]"));
  CHECK_THROWS_WITH(space_to_depth(tape.constant(x)),
                    "[space_to_depth] x must have an even height and width, got shape [1, 2, 3, 1]");
}

TEST_CASE("resample: float against double, and the same bits for any thread count") {
  const auto x = uniform<float>({3, 40, 42, 9}, -1, 1, 1);
  expect_same_bits(to(77, 91), {x});
  expect_same_bits(f_double, {x});
  expect_same_bits(f_depth, {x});
  CHECK(float_error(to(77, 91), {x}) < 5e-7);  // measured 2.1e-7
  const auto of_channels = [](Index e) { return std::vector{uniform<float>({1, 2, 4, e}, -1, 1, 2)}; };
  CHECK(float_error_to_130(to(3, 5), of_channels) < 5e-7);
  CHECK(float_error_to_130(f_double, of_channels) < 5e-7);
  CHECK(float_error_to_130(f_depth, of_channels) < 5e-7);
}
