#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>

#include "support/each_isa.h"
#include "support/expect_grad.h"
#include "support/worst.h"

using namespace fieldmark;

TEST_CASE("matmul: values by hand") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}, {1, 2, 3, 4, 5, 6}), b({3, 2}, {7, 8, 9, 10, 11, 12});
  const auto y = matmul(tape.constant(a), tape.constant(b));
  CHECK(std::vector<double>(y.value(), y.value() + 4) == std::vector<double>{58, 64, 139, 154});
}

TEST_CASE("matmul: gradient, also of empty and single extents") {
  const GradcheckFn f = [](Tape<double>&, auto v) { return matmul(v[0], v[1]); };
  expect_grad(f, {uniform({3, 5}, -1, 1, 1), uniform({5, 4}, -1, 1, 2)});
  expect_grad(f, {uniform({1, 1}, -1, 1, 1), uniform({1, 1}, -1, 1, 2)});
  expect_grad(f, {uniform({0, 5}, -1, 1, 1), uniform({5, 4}, -1, 1, 2)});
  expect_grad(f, {uniform({2, 0}, -1, 1, 1), uniform({0, 4}, -1, 1, 2)});
}

namespace {
// Returns the largest error of the float product and of its gradients against loops in double, each relative
// to its largest magnitude.
double worst_error(Index m, Index k, Index n) {
  const auto a = uniform<float>({m, k}, -1, 1, 1), b = uniform<float>({k, n}, -1, 1, 2),
             g = uniform<float>({m, n}, -1, 1, 3);
  Tape<float> tape;
  Tensor<float> da(a.shape), db(b.shape);
  const auto y = matmul(tape.leaf(a, da), tape.leaf(b, db));
  tape.backward(y, g.data);
  std::vector<double> want(static_cast<std::size_t>(m * n)), want_a(a.data.size()), want_b(b.data.size());
  for (Index i = 0; i < m; ++i)
    for (Index j = 0; j < n; ++j)
      for (Index s = 0; s < k; ++s) {
        const auto to = static_cast<std::size_t>(i * n + j), of_a = static_cast<std::size_t>(i * k + s),
                   of_b = static_cast<std::size_t>(s * n + j);
        want[to] += static_cast<double>(a.data[of_a]) * static_cast<double>(b.data[of_b]);
        want_a[of_a] += static_cast<double>(g.data[to]) * static_cast<double>(b.data[of_b]);
        want_b[of_b] += static_cast<double>(g.data[to]) * static_cast<double>(a.data[of_a]);
      }
  const auto error = [](const float* got, const std::vector<double>& exact) {
    double worst = 0, largest = 1e-30;
    for (std::size_t i = 0; i < exact.size(); ++i) {
      const double d = std::abs(static_cast<double>(got[i]) - exact[i]);
      raise_to(worst, d);
      raise_to(largest, std::abs(exact[i]));
    }
    return worst / largest;
  };
  double worst = error(y.value(), want);
  raise_to(worst, error(da.data.data(), want_a));
  raise_to(worst, error(db.data.data(), want_b));
  return worst;
}
}  // namespace

TEST_CASE(
    "matmul: the float path, forward and both gradients, against double loops for extents of 1 to 130") {
  each_isa([] {
    for (Index e = 1; e <= 130; ++e) {
      CAPTURE(e);
      CHECK(worst_error(e, 37, 19) < 1e-6);
      CHECK(worst_error(23, e, 17) < 1e-6);
      CHECK(worst_error(13, 29, e) < 1e-6);
    }
  });
}

TEST_CASE("matmul: errors") {
  Tape<float> tape;
  const Tensor<float> a({2, 3}), b({2, 2}), c({3});
  CHECK_THROWS_WITH(
      matmul(tape.constant(a), tape.constant(b)),
      "[matmul] b: axis 0 must be 3 (the columns of a, whose shape is [2, 3]), got shape [2, 2]");
  CHECK_THROWS_WITH(matmul(tape.constant(c), tape.constant(b)),
                    "[matmul] a must have rank 2 [m, k], got shape [3]");
}

TEST_CASE("matmul: same bits for 1 and 2 threads") {
  const auto a = uniform<float>({5000, 20}, -1, 1, 1), b = uniform<float>({20, 30}, -1, 1, 2);
  const auto run = [&](int n) {
    const ScopedThreads scope(n);
    Tape<float> tape;
    Tensor<float> da(a.shape), db(b.shape);
    const auto y = matmul(tape.leaf(a, da), tape.leaf(b, db));
    tape.backward(y, std::vector<float>(y.value(), y.value() + 150000));
    da.data.insert(da.data.end(), db.data.begin(), db.data.end());
    return da.data;
  };
  CHECK(run(1) == run(2));
}
