#include <fieldmark/engine/ops/comparison.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_where = [](auto&, auto v) { return where(greater(v[0], v[1]), v[0], v[1]); };

TEST_CASE("comparison: values") {
  const double nan = std::nan("");
  const std::vector<Tensor<double>> in{{{2, 3}, {1, 2, 3, nan, 5, 6}}, {{3}, {2, 2, nan}}};
  CHECK(op_values([](auto&, auto v) { return greater(v[0], v[1]); }, in) ==
        std::vector<double>{0, 0, 0, 0, 1, 0});
  CHECK(op_values([](auto&, auto v) { return less(v[0], v[1]); }, in) ==
        std::vector<double>{1, 0, 0, 0, 0, 0});
  CHECK(op_values([](auto&, auto v) { return equal(v[0], v[1]); }, in) ==
        std::vector<double>{0, 1, 0, 0, 0, 0});
}

TEST_CASE("comparison: where takes what the mask says, and its gradient sees nothing else") {
  const double inf = std::numeric_limits<double>::infinity();
  Tape<double> tape;
  const Tensor<double> mask({2, 1}, {1, 0}), a({2}, {3, inf}), b({2, 2}, {inf, std::nan(""), 7, 8});
  Tensor<double> da({2}), db({2, 2});
  const auto y = where(tape.constant(mask), tape.leaf(a, da), tape.leaf(b, db));
  CHECK(y.shape() == Shape{2, 2});
  CHECK(std::vector<double>(y.value(), y.value() + 4) == std::vector<double>{3, inf, 7, 8});
  tape.backward(y, std::vector<double>{1, 2, 3, 4});
  CHECK(da.data == std::vector<double>{1, 2});
  CHECK(db.data == std::vector<double>{0, 0, 3, 4});
}

TEST_CASE("comparison: gradient") {
  for (Shape s : {Shape{0}, Shape{1}, Shape{3, 5}}) {
    CAPTURE(s.str());
    expect_grad(f_where, {uniform(s, -1, 1, 1), uniform(s, -1, 1, 2)});
  }
  Tape<double> tape;
  const Tensor<double> x({1}, 3.0);
  Tensor<double> g({1});
  const auto v = tape.leaf(x, g);
  CHECK_FALSE(greater(v, v).needs_grad());
}

TEST_CASE("comparison: errors") {
  Tape<double> tape, other;
  const Tensor<double> a({2, 3}), b({4});
  const auto x = tape.constant(a), y = tape.constant(b);
  CHECK_THROWS_WITH(greater(x, y), Contains("[greater] b must broadcast with a, whose shape is [2, 3]"));
  CHECK_THROWS_WITH(less(x, y), Contains("[less] b must broadcast"));
  CHECK_THROWS_WITH(equal(x, y), Contains("[equal] b must broadcast"));
  CHECK_THROWS_WITH(where(x, x, y), Contains("[where] b must broadcast"));
  CHECK_THROWS_WITH(where(y, x, x), Contains("[where: mask] b must broadcast") && Contains("got shape [4]"));
  CHECK_THROWS_AS(greater(x, other.constant(a)), ValueError);
}

TEST_CASE("comparison: same bits for any thread count") {
  expect_same_bits(f_where, {uniform<float>({3001, 33}, -1, 1, 1), uniform<float>({33}, -1, 1, 2)});
}
