#include <fieldmark/engine/ops/batched_matmul.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_bmm = [](auto&, auto v) { return batched_matmul(v[0], v[1]); };

TEST_CASE("batched_matmul: values as of three loops, with axes that broadcast") {
  const auto a = uniform({2, 1, 3, 4}, -1, 1, 1), b = uniform({5, 4, 2}, -1, 1, 2);
  Tape<double> tape;
  const auto y = batched_matmul(tape.constant(a), tape.constant(b));
  REQUIRE(y.shape() == Shape{2, 5, 3, 2});
  for (Index p = 0; p < 10; ++p)
    for (Index i = 0; i < 3; ++i)
      for (Index j = 0; j < 2; ++j) {
        double want = 0;
        for (Index k = 0; k < 4; ++k) want += a[(p / 5 * 3 + i) * 4 + k] * b[(p % 5 * 4 + k) * 2 + j];
        CHECK(y.value()[(p * 3 + i) * 2 + j] == Approx(want).epsilon(1e-14));
      }
}

TEST_CASE("batched_matmul: gradient") {
  const auto check = [](Shape a, Shape b) {
    CAPTURE(a.str(), b.str());
    expect_grad(f_bmm, {uniform(a, -1, 1, 1), uniform(b, -1, 1, 2)});
  };
  check({3, 4}, {4, 2});
  check({2, 3, 4}, {2, 4, 2});
  check({2, 3, 4}, {4, 2});
  check({3, 4}, {2, 4, 2});
  check({2, 1, 3, 4}, {3, 4, 1});
  check({0, 3, 4}, {4, 2});
  check({2, 1, 0}, {2, 0, 3});
}

TEST_CASE("batched_matmul: float against double for extents of 1 to 130") {
  CHECK(float_error_to_130(f_bmm, [](Index e) {
          return std::vector{uniform<float>({2, 3, e}, -1, 1, 1), uniform<float>({2, e, 5}, -1, 1, 2)};
        }) < 1e-6);
}

TEST_CASE("batched_matmul: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3, 4}), b({2, 5, 2}), c({4}), d({3, 4, 2});
  const auto x = tape.constant(a);
  CHECK_THROWS_WITH(batched_matmul(x, tape.constant(c)),
                    "[batched_matmul] b must have rank 2 or more [.., k, n], got shape [4]");
  CHECK_THROWS_WITH(batched_matmul(tape.constant(c), x), Contains("a must have rank 2 or more [.., m, k]"));
  CHECK_THROWS_WITH(batched_matmul(x, tape.constant(b)),
                    "[batched_matmul] b: axis 1 must be 4 (the columns of a, whose shape is [2, 3, 4]), got "
                    "shape [2, 5, 2]");
  CHECK_THROWS_WITH(batched_matmul(x, tape.constant(d)),
                    Contains("[batched_matmul: batch axes] b must broadcast with a, whose shape is [2]"));
}

TEST_CASE("batched_matmul: same bits for any thread count") {
  expect_same_bits(f_bmm, {uniform<float>({7, 65, 33}, -1, 1, 1), uniform<float>({7, 33, 29}, -1, 1, 2)});
  expect_same_bits(f_bmm, {uniform<float>({65, 33}, -1, 1, 1), uniform<float>({7, 33, 29}, -1, 1, 2)});
}
