#include <fieldmark/engine/ops/cholesky.h>

#include "support/expect_grad.h"
#include "support/matrices.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_cholesky = [](auto&, auto v) { return cholesky(v[0]); };

TEST_CASE("cholesky: values") {
  const auto l = op_values(f_cholesky, std::vector{Tensor<double>({2, 2}, {4, 2, 2, 5})});
  CHECK(l == std::vector<double>{2, 0, 1, 2});
  const auto a = regular({2, 5, 5}, 1);
  const auto factor = op_values(f_cholesky, std::vector{a});
  for (Index i = 0; i < 2; ++i)
    for (Index r = 0; r < 5; ++r)
      for (Index c = 0; c < 5; ++c) {
        double product = 0;
        for (Index k = 0; k < 5; ++k)
          product += factor[at((i * 5 + r) * 5 + k)] * factor[at((i * 5 + c) * 5 + k)];
        CHECK(product == Approx((a[(i * 5 + r) * 5 + c] + a[(i * 5 + c) * 5 + r]) / 2).margin(1e-14));
        if (c > r) CHECK(factor[at((i * 5 + r) * 5 + c)] == 0);
      }
}

TEST_CASE("cholesky: gradient") {
  for (Shape s : {Shape{0, 0}, Shape{1, 1}, Shape{2, 4, 4}}) expect_grad(f_cholesky, {regular(s, 1)});
}

TEST_CASE("cholesky: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), indefinite({2, 2}, {1, 2, 2, 1}), nan({1, 1}, std::nan(""));
  CHECK_THROWS_WITH(cholesky(tape.constant(a)),
                    "[cholesky] a must be square matrices [.., n, n], got shape [2, 3]");
  CHECK_THROWS_WITH(cholesky(tape.constant(indefinite)),
                    "[cholesky] a: matrix 0 must be positive definite, got one that is not");
  CHECK_THROWS_WITH(cholesky(tape.constant(nan)), Contains("matrix 0 must be finite"));
}

TEST_CASE("cholesky: the first of several singular matrices is named for any thread count") {
  expect_first_bad_named([](auto a) { return cholesky(a); }, "cholesky");
}

TEST_CASE("cholesky: same bits for any thread count") {
  expect_same_bits(f_cholesky, {regular<float>({50, 9, 9}, 1)});
  expect_same_bits(f_cholesky, {regular<float>({150, 150}, 1)});
}
