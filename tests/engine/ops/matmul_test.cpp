#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/parallel.h>

#include "support/expect_grad.h"

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
    set_threads(n);
    Tape<float> tape;
    Tensor<float> da(a.shape), db(b.shape);
    const auto y = matmul(tape.leaf(a, da), tape.leaf(b, db));
    tape.backward(y, std::vector<float>(y.value(), y.value() + 150000));
    da.data.insert(da.data.end(), db.data.begin(), db.data.end());
    return da.data;
  };
  const int before = threads();
  CHECK(run(1) == run(2));
  set_threads(before);
}
