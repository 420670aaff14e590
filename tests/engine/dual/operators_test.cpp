#include <fieldmark/engine/dual/operators.h>

#include "support/dual_op.h"

using namespace fieldmark;

TEST_CASE("dual/operators: the rational functions of a number") {
  const auto at = [](const auto& f) { return derivatives([&](auto&, auto x) { return f(x[0]); }, 2); };
  const auto polynomial = at([](auto x) { return 3.0 * x * x * x - x / 4.0 + 1.0; });
  CHECK(polynomial.value == 24.5);
  CHECK(polynomial.first == 35.75);
  CHECK(polynomial.second == 36);
  const auto fraction = at([](auto x) { return (1.0 + x) / (-x) - (5.0 - x); });
  CHECK(fraction.value == -4.5);
  CHECK(fraction.first == 1.25);
  CHECK(fraction.second == -0.25);
  const auto inverse = at([](auto x) { return 8.0 / x - 1.0 + x * 0.5; });
  CHECK(inverse.value == 4);
  CHECK(inverse.first == -1.5);
  CHECK(inverse.second == 2);
}

TEST_CASE("dual/operators: with a Var on either side, in float") {
  const Tensor<float> c({2}, {3, 5}), x({2}, {1, 2}), v({2}, {1, 10});
  const auto f = [&](auto& tape, auto q) {
    const auto k = tape.constant(c);
    return (k * q[0] + k) - (q[0] * k - q[0] / k) + k / q[0];
  };
  const auto r = jvp(f, {x}, {v});
  CHECK(r.product[0] == Approx(1 / 3.0 - 3));
  CHECK(r.product[1] == Approx(10 / 5.0 - 5 * 10 / 4.0));
}
