#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/values.h>

#include <cmath>
#include <limits>

#include "support/dual_op.h"

using namespace fieldmark;

namespace {

// Returns the tangent of f(a, b) where a' = 2 and b' = 7.
template <class F>
double tangent_of_two(const F& f, double a, double b) {
  return jvp([&](auto&, auto x) { return f(x[0], x[1]); }, {Tensor<double>({1}, a), Tensor<double>({1}, b)},
             {Tensor<double>({1}, 2.0), Tensor<double>({1}, 7.0)})
      .product[0];
}

}  // namespace

TEST_CASE("dual/arithmetic: tangents of two numbers") {
  CHECK(tangent_of_two([](auto a, auto b) { return add(a, b); }, 3, 5) == 9);
  CHECK(tangent_of_two([](auto a, auto b) { return sub(a, b); }, 3, 5) == -5);
  CHECK(tangent_of_two([](auto a, auto b) { return mul(a, b); }, 3, 5) == 2 * 5 + 3 * 7);
  CHECK(tangent_of_two([](auto a, auto b) { return div(a, b); }, 3, 5) ==
        Approx((2 - 0.6 * 7) / 5).epsilon(1e-15));
  CHECK(tangent_of_two([](auto a, auto b) { return pow(a, b); }, 3, 5) ==
        Approx(2 * 5 * 81 + 7 * 243 * std::log(3)).epsilon(1e-15));
  CHECK(tangent_of_two([](auto a, auto) { return scale(a, -3); }, 3, 5) == -6);
}

TEST_CASE("dual/arithmetic: the tangent of the chosen, the first of equals") {
  const auto least = [](auto a, auto b) { return minimum(a, b); };
  const auto most = [](auto a, auto b) { return maximum(a, b); };
  const auto chosen = [](auto a, auto b) { return where(less(a, b), a, b); };
  CHECK(tangent_of_two(least, 3, 5) == 2);
  CHECK(tangent_of_two(least, 5, 3) == 7);
  CHECK(tangent_of_two(least, 3, 3) == 2);
  CHECK(tangent_of_two(most, 3, 5) == 7);
  CHECK(tangent_of_two(most, 5, 3) == 2);
  CHECK(tangent_of_two(most, 3, 3) == 2);
  CHECK(tangent_of_two(chosen, 3, 5) == 2);
  CHECK(tangent_of_two(chosen, 5, 3) == 7);
}

TEST_CASE("dual/arithmetic: powers of 0") {
  const auto power = [](auto a, auto b) { return pow(a, b); };
  CHECK(tangent_of_two(power, 0, 0) == 0);
  CHECK(tangent_of_two(power, 0, 1) == 2);
  CHECK(tangent_of_two(power, 0, 3) == 0);
  CHECK(std::isnan(tangent_of_two(power, -1, 2)));  // log of a negative base
}

TEST_CASE("dual/arithmetic: one operand may be a Var, and both broadcast") {
  const auto x = uniform({2, 3}, 0.5, 1, 1), v = uniform({2, 3}, -1, 1, 2), row = uniform({4, 1, 3}, 1, 2, 3);
  const auto expect = [&](const auto& op) {
    // Equals the same op of Duals with a tangent of 0 for one of them.
    const Tensor<double> zero(row.shape);
    for (const bool swapped : {false, true}) {
      const auto mixed = jvp(
          [&](auto& tape, auto q) {
            const auto c = tape.constant(row);
            return swapped ? op(c, q[0]) : op(q[0], c);
          },
          {x}, {v});
      const auto duals =
          jvp([&](auto&, auto q) { return swapped ? op(q[1], q[0]) : op(q[0], q[1]); }, {x, row}, {v, zero});
      CHECK(mixed.value.data == duals.value.data);
      CHECK(mixed.product.shape == Shape{4, 2, 3});
      double worst = 0;
      for (Index i = 0; i < mixed.product.size(); ++i)
        raise_to(worst, std::abs(mixed.product[i] - duals.product[i]));
      CHECK(worst < 1e-15);
    }
  };
  expect([](auto a, auto b) { return add(a, b); });
  expect([](auto a, auto b) { return sub(a, b); });
  expect([](auto a, auto b) { return mul(a, b); });
  expect([](auto a, auto b) { return div(a, b); });
  expect([](auto a, auto b) { return pow(a, b); });
  expect([](auto a, auto b) { return minimum(a, b); });
  expect([](auto a, auto b) { return maximum(a, b); });
  expect([](auto a, auto b) { return where(greater(a, b), a, b); });
}

TEST_CASE("dual/arithmetic: comparisons are constants") {
  Tape<double> tape;
  const Tensor<double> t({3}, {1, 2, 3});
  const Dual<double> x(tape.constant(t), tape.constant(t));
  const Var<double> two = tape.constant(&t.data[1], {});
  CHECK(to_tensor(greater(x, two)).data == std::vector<double>{0, 0, 1});
  CHECK(to_tensor(less(x, two)).data == std::vector<double>{1, 0, 0});
  CHECK(to_tensor(equal(two, x)).data == std::vector<double>{0, 1, 0});
  CHECK(to_tensor(equal(x, x)).data == std::vector<double>{1, 1, 1});
}

TEST_CASE("dual/arithmetic: where() lets nothing through of what it does not choose") {
  const auto f = [](auto&, auto x) {
    const auto v = x[0];
    return where(greater(v, scale(v, 0.5)), log(v), v);
  };
  const auto r = jvp(f, {Tensor<double>({2}, {-1, 2})}, {Tensor<double>({2}, {1, 1})});
  CHECK(r.product.data == std::vector<double>{1, 0.5});
  const auto total = [&](auto& tape, auto x) { return sum(f(tape, x)); };
  CHECK(hvp(total, {Tensor<double>({2}, {-1, 2})}, {Tensor<double>({2}, {1, 1})}).products[0].data ==
        std::vector<double>{0, -0.25});
}

TEST_CASE("dual/arithmetic: shapes that do not broadcast throw as with Vars") {
  const auto f = [](auto&, auto x) { return add(x[0], x[1]); };
  const Tensor<double> a({2}), b({3});
  CHECK_THROWS_AS(jvp(f, {a, b}, {a, b}), ShapeError);
}

TEST_CASE("dual/arithmetic: in float as in double") {
  const std::vector<Tensor<float>> in{uniform<float>({5, 7}, 0.5, 2, 1), uniform<float>({7}, 0.5, 2, 2)};
  const auto check = [&](const auto& f) {
    CHECK(float_products_error([&](auto&, auto v) { return f(v[0], v[1]); }, in) < 1e-5);
  };
  check([](auto a, auto b) { return mul(add(a, b), sub(a, scale(b, 3))); });
  check([](auto a, auto b) { return pow(div(a, b), b); });
  check([](auto a, auto b) { return maximum(minimum(a, b), where(equal(a, b), a, mul(b, b))); });
}
