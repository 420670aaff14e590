#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/dual/matrices.h>
#include <fieldmark/engine/dual/operators.h>
#include <fieldmark/engine/dual/reduce.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/products.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {

const Tensor<double> kProductMatrix({2, 3}, {1, 2, 3, 4, 5, 6});

// y = x M, with the Jacobian M^T.
const auto product_map = [](auto& tape, auto x) { return matmul(x[0], tape.constant(kProductMatrix)); };
// y = x A x^T with A = M M^T, whose Hessian is A + A^T.
const auto product_form = [](auto& tape, auto x) {
  return sum(square(matmul(x[0], tape.constant(kProductMatrix))));
};

std::vector<double> product_values(std::vector<double> v) { return v; }

}  // namespace

TEST_CASE("products: jvp and vjp of a linear map are products with its matrix") {
  const Tensor<double> x({1, 2}, {0.5, -1}), v({1, 2}, {10, 1}), u({1, 3}, {1, 0, 2});
  const auto forward = jvp(product_map, {x}, {v});
  CHECK(forward.value.shape == Shape{1, 3});
  CHECK(forward.value.data == product_values({-3.5, -4, -4.5}));
  CHECK(forward.product.shape == Shape{1, 3});
  CHECK(forward.product.data == product_values({14, 25, 36}));
  const auto reverse = vjp(product_map, {x}, u);
  CHECK(reverse.value.data == forward.value.data);
  REQUIRE(reverse.products.size() == 1);
  CHECK(reverse.products[0].shape == Shape{1, 2});
  CHECK(reverse.products[0].data == product_values({7, 16}));
}

TEST_CASE("products: the Hessian of a product_form form is its matrix, and that of a linear one 0") {
  const Tensor<double> x({1, 2}, {0.5, -1}), v({1, 2}, {1, -2});
  const auto h = hvp(product_form, {x}, {v});
  CHECK(h.value.data == product_values({3.5 * 3.5 + 16 + 4.5 * 4.5}));
  CHECK(h.products[0].data == product_values({2 * (14 - 64), 2 * (32 - 154)}));
  const auto linear = [](auto& tape, auto x_) { return sum(matmul(x_[0], tape.constant(kProductMatrix))); };
  CHECK(hvp(linear, {x}, {v}).products[0].data == product_values({0, 0}));
}

TEST_CASE("products: several inputs, mixed second derivatives") {
  // f = a^2 b: H = (2 b, 2 a; 2 a, 0).
  const auto f = [](auto&, auto x) { return sum(square(x[0]) * x[1]); };
  const Tensor<double> a({1}, 3.0), b({1}, 5.0), da({1}, 2.0), db({1}, 7.0);
  CHECK(jvp(f, {a, b}, {da, db}).product[0] == 2 * 3 * 5 * 2 + 9 * 7);
  const auto gradient = vjp(f, {a, b}, Tensor<double>({1}, 1.0)).products;
  CHECK(gradient[0][0] == 30);
  CHECK(gradient[1][0] == 9);
  const auto h = hvp(f, {a, b}, {da, db}).products;
  CHECK(h[0][0] == 2 * 5 * 2 + 2 * 3 * 7);
  CHECK(h[1][0] == 2 * 3 * 2);
}

TEST_CASE("products: a Hessian column by column against its closed form") {
  // f = log sum exp x: H = diag(p) - p p^T.
  const auto f = [](auto&, auto x) { return logsumexp(x[0], {0}); };
  const Tensor<double> x({3}, {0.2, -0.7, 1.1});
  double z = 0;
  for (const double v : x.data) z += std::exp(v);
  for (Index j = 0; j < 3; ++j) {
    Tensor<double> unit({3});
    unit[j] = 1;
    const auto column = hvp(f, {x}, {unit}).products[0];
    for (Index i = 0; i < 3; ++i) {
      const double p = std::exp(x[i]) / z, q = std::exp(x[j]) / z;
      CHECK(column[i] == Approx((i == j ? p : 0) - p * q).epsilon(1e-14));
    }
  }
}

TEST_CASE("products: inputs without influence and tangents of 0 give zeros") {
  const auto f = [](auto&, auto x) { return exp(x[0]); };
  const Tensor<double> a({2}, {1, 2}), b({3}, 1.0), none({2}), u({2}, 1.0);
  CHECK(jvp(f, {a, b}, {none, b}).product.data == product_values({0, 0}));
  CHECK(vjp(f, {a, b}, u).products[1].data == product_values({0, 0, 0}));
  const auto constant = [&](auto& tape, auto) { return tape.constant(a); };
  CHECK(jvp(constant, {b}, {b}).product.data == product_values({0, 0}));
  CHECK(vjp(constant, {b}, u).products[0].data == product_values({0, 0, 0}));
  const auto one = [&](auto&, auto x) { return sum(exp(x[0])); };
  CHECK(hvp(one, {a, b}, {none, b}).products[0].data == product_values({0, 0}));
}

TEST_CASE("products: a mean over thousands of rows, in float as in double") {
  const auto w = uniform<float>({3, 5}, -1, 1, 2);
  const Tensor<double> w2(w.shape, std::vector<double>(w.data.begin(), w.data.end()));
  const auto x = uniform<float>({4000, 3}, -1, 1, 1), v = uniform<float>({4000, 3}, -1, 1, 3);
  const auto wide = [](const Tensor<float>& t) {
    return Tensor<double>(t.shape, std::vector<double>(t.data.begin(), t.data.end()));
  };
  const auto got =
      hvp([&](auto& tape, auto q) { return sum(tanh(matmul(q[0], tape.constant(w)))); }, {x}, {v});
  const auto want = hvp([&](auto& tape, auto q) { return sum(tanh(matmul(q[0], tape.constant(w2)))); },
                        {wide(x)}, {wide(v)});
  double worst = 0;
  for (Index i = 0; i < want.products[0].size(); ++i)
    raise_to(worst, std::abs(static_cast<double>(got.products[0][i]) - want.products[0][i]));
  CHECK(worst < 1e-5);
}

TEST_CASE("products: errors") {
  const Tensor<double> x({1, 2}), v({2, 1}), u({3});
  CHECK_THROWS_WITH(jvp(product_map, {x}, {x, x}), "[jvp] tangents must be as many as the inputs, 1, got 2");
  CHECK_THROWS_WITH(jvp(product_map, {x}, {v}),
                    "[jvp] tangent 0 must have the shape of its input, [1, 2], got shape [2, 1]");
  CHECK_THROWS_WITH(vjp(product_map, {x}, u),
                    "[vjp] cotangent must have the shape of f's value, [1, 3], got shape [3]");
  CHECK_THROWS_WITH(hvp(product_form, {x, x}, {x}),
                    "[hvp] directions must be as many as the inputs, 2, got 1");
  CHECK_THROWS_WITH(hvp(product_form, {x}, {v}),
                    "[hvp] direction 0 must have the shape of its input, [1, 2], got shape [2, 1]");
  CHECK_THROWS_WITH(hvp(product_map, {x}, {x}), "[hvp] f must return one element, got shape [1, 3]");
  const Tensor<double> short_of({1, 2}, std::vector<double>{1});
  CHECK_THROWS_AS(jvp(product_map, {short_of}, {x}), ShapeError);
  CHECK_THROWS_AS(vjp(product_map, {short_of}, Tensor<double>({1, 3})), ShapeError);
  Tape<double> other;
  const auto elsewhere = [&](auto&, auto) { return other.constant(x); };
  for (const auto& run : {+[](const DualFunction<double>&f, const Tensor<double>&t) { jvp(f, {t}, {t}); },
                          +[](const DualFunction<double>&f, const Tensor<double>&t) { hvp(f, {t}, {t}); }})
    CHECK_THROWS_WITH(run(elsewhere, x), Contains("f must return a value of the tape that it is given"));
  CHECK_THROWS_WITH(vjp(elsewhere, {x}, x), Contains("[vjp] f must return a value of the tape"));
}

TEST_CASE("products: vjp and hvp add to the gradients of a store that f reads with gradients") {
  ParamStore<double> store;
  const auto id = store.add("w", {2});
  store.values()[0] = 3, store.values()[1] = 4;
  const Tensor<double> x({2}, {0.5, -1}), u({2}, {1, 10}), v({2}, {1, 1});
  for (const bool gradients : {true, false}) {
    const Params<double> params = gradients ? Params<double>(store) : Params<double>(store, nullptr);
    store.zero_grad();
    const auto linear = [&](Tape<double>& tape, auto xs) { return xs[0] * params.leaf(tape, id); };
    CHECK(vjp<double>(linear, {x}, u).products[0].data == product_values({3, 40}));
    CHECK(store.grads()[0] == (gradients ? 0.5 : 0));
    CHECK(store.grads()[1] == (gradients ? -10 : 0));
    store.zero_grad();
    const auto scaled = [&](Tape<double>& tape, auto xs) {
      return sum(square(xs[0]) * Dual<double>(params.leaf(tape, id)));
    };
    CHECK(hvp<double>(scaled, {x}, {v}).products[0].data == product_values({6, 8}));
    CHECK((store.grads()[0] != 0) == gradients);
  }
}
