#include <fieldmark/engine/ops/eigenvalues.h>
#include <fieldmark/engine/ops/reduce_axes.h>

#include "support/expect_grad.h"
#include "support/matrices.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_eigenvalues = [](auto&, auto v) { return symmetric_eigenvalues(v[0]); };

TEST_CASE("eigenvalues: values") {
  const auto y = op_values(f_eigenvalues, std::vector{Tensor<double>({2, 2, 2}, {2, 1, 1, 2, 5, 0, 0, -1})});
  const std::vector<double> want{1, 3, -1, 5};
  for (std::size_t i = 0; i < 4; ++i) CHECK(y[i] == Approx(want[i]).epsilon(1e-14));
  // Of a non-symmetric matrix, only the symmetric part counts.
  const auto part = op_values(f_eigenvalues, std::vector{Tensor<double>({2, 2}, {2, 2, 0, 2})});
  CHECK(part[0] == Approx(1).epsilon(1e-14));
  CHECK(part[1] == Approx(3).epsilon(1e-14));
}

TEST_CASE("eigenvalues: gradient") {
  for (Shape s : {Shape{0, 0}, Shape{1, 1}, Shape{2, 4, 4}})
    expect_grad(f_eigenvalues, {regular(s, 1)}, {.step = 0.3});
  // The sum of equal eigenvalues is the trace.
  Tape<double> tape;
  const Tensor<double> one({2, 2}, {3, 0, 0, 3});
  Tensor<double> g({2, 2});
  tape.backward(sum(symmetric_eigenvalues(tape.leaf(one, g)), {0}));
  CHECK(g[0] == Approx(1).epsilon(1e-15));
  CHECK(std::abs(g[1]) < 1e-15);
}

TEST_CASE("eigenvalues: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), nan({1, 1}, std::nan(""));
  CHECK_THROWS_WITH(symmetric_eigenvalues(tape.constant(a)),
                    "[symmetric_eigenvalues] a must be square matrices [.., n, n], got shape [2, 3]");
  CHECK_THROWS_WITH(symmetric_eigenvalues(tape.constant(nan)),
                    "[symmetric_eigenvalues] a: matrix 0 must be finite, got a NaN or an infinity");
}

TEST_CASE("eigenvalues: the first of several bad matrices is named for any thread count") {
  expect_first_bad_named([](auto a) { return symmetric_eigenvalues(a); }, "symmetric_eigenvalues",
                         std::nan(""));
}

TEST_CASE("eigenvalues: same bits for any thread count") {
  expect_same_bits(f_eigenvalues, {regular<float>({50, 9, 9}, 1)});
}
