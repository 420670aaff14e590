#include <fieldmark/engine/ops/determinant.h>

#include "support/expect_grad.h"
#include "support/matrices.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_det = [](auto&, auto v) { return determinant(v[0]); };
static const auto f_log_det = [](auto&, auto v) { return log_determinant(v[0]); };

TEST_CASE("determinant: values") {
  const std::vector<Tensor<double>> in{{{2, 2, 2}, {1, 2, 3, 4, 0, -3, 5, 1}}};
  const auto det = op_values(f_det, in), log_det = op_values(f_log_det, in);
  CHECK(det[0] == Approx(-2).epsilon(1e-15));
  CHECK(det[1] == Approx(15).epsilon(1e-15));
  CHECK(log_det[0] == Approx(std::log(2)).epsilon(1e-15));
  CHECK(log_det[1] == Approx(std::log(15)).epsilon(1e-15));
  // 40 times 1e10: the determinant overflows, its logarithm does not.
  Tensor<double> large({40, 40});
  for (Index i = 0; i < 40; ++i) large[41 * i] = 1e10;
  CHECK(op_values(f_log_det, std::vector{large})[0] == Approx(400 * std::log(10)).epsilon(1e-15));
}

TEST_CASE("determinant: gradient") {
  for (Shape s : {Shape{0, 0}, Shape{1, 1}, Shape{2, 3, 3}}) {
    CAPTURE(s.str());
    expect_grad(f_det, {regular(s, 1)});
    expect_grad(f_log_det, {regular(s, 1)});
  }
  expect_grad(f_det, {Tensor<double>({3, 3}, {1, 2, 3, 2, 4, 6, 1, 0, 1})});  // singular
  expect_grad(f_det, {Tensor<double>({3, 3}, 1.0)});                          // rank 1: no gradient
}

TEST_CASE("determinant: errors") {
  Tape<double> tape;
  const Tensor<double> a({3}), singular({2, 2}, 1.0), nan({1, 1}, std::nan(""));
  CHECK_THROWS_WITH(determinant(tape.constant(a)),
                    "[determinant] a must be square matrices [.., n, n], got shape [3]");
  CHECK_THROWS_WITH(determinant(tape.constant(nan)),
                    "[determinant] a: matrix 0 must be finite, got a NaN or an infinity");
  CHECK_THROWS_WITH(log_determinant(tape.constant(singular)),
                    Contains("[log_determinant] a: matrix 0 must not be singular"));
}

TEST_CASE("determinant: the first of several bad matrices is named for any thread count") {
  expect_first_bad_named([](auto a) { return log_determinant(a); }, "log_determinant");
  expect_first_bad_named([](auto a) { return determinant(a); }, "determinant", std::nan(""));
}

TEST_CASE("determinant: same bits for any thread count") {
  expect_same_bits(f_det, {regular<float>({50, 9, 9}, 1)});
  expect_same_bits(f_log_det, {regular<float>({50, 9, 9}, 1)});
}
