#include <fieldmark/engine/dual/layout.h>
#include <fieldmark/engine/dual/matrices.h>
#include <fieldmark/engine/dual/operators.h>

#include <cmath>

#include "support/dual_op.h"

using namespace fieldmark;

namespace {

// Returns matrices far from singular: noise plus a diagonal of 4.
template <class T = double>
Tensor<T> far_from_singular(Index batch, Index n) {
  auto t = uniform<T>({batch, n, n}, -1, 1, 1);
  for (Index i = 0; i < batch; ++i)
    for (Index k = 0; k < n; ++k) t[(i * n + k) * n + k] += 4;
  return t;
}

const Tensor<double> kMatrixA = far_from_singular(2, 3), kMatrixB = uniform({2, 3, 2}, -1, 1, 2);
const Tensor<double> kMatrixDa = uniform({2, 3, 3}, -1, 1, 3), kMatrixDb = uniform({2, 3, 2}, -1, 1, 4);

// Returns the largest entry of the tangent of f, which is constant by construction.
template <class F>
double largest_tangent(const F& f) {
  const auto r =
      jvp([&](auto&, auto x) { return f(x[0], x[1]); }, {kMatrixA, kMatrixB}, {kMatrixDa, kMatrixDb}).product;
  double largest = 0;
  for (const double v : r.data) raise_to(largest, std::abs(v));
  return largest;
}

}  // namespace

TEST_CASE("dual/matrices: what a solution was made for holds along a tangent too") {
  // a x - b, a y - I, L L^T - a and log det - log |det| are constant.
  CHECK(largest_tangent([](auto a, auto b) { return batched_matmul(a, solve(a, b)) - b; }) < 1e-14);
  CHECK(largest_tangent([](auto a, auto) { return batched_matmul(a, inverse(a)); }) < 1e-14);
  CHECK(largest_tangent([](auto a, auto) {
          const auto symmetric = a + transpose(a), l = cholesky(symmetric);
          return batched_matmul(l, transpose(l)) - symmetric;
        }) < 1e-13);
  CHECK(largest_tangent([](auto a, auto) { return log(determinant(a)) - log_determinant(a); }) < 1e-14);
}

TEST_CASE("dual/matrices: triangular_solve reads one triangle, transposed or not") {
  for (const bool upper : {false, true})
    for (const bool transposed : {false, true}) {
      CAPTURE(upper, transposed);
      CHECK(largest_tangent([=](auto a, auto b) {
              double* mask = a.tape().scratch(9);
              for (Index i = 0; i < 9; ++i) mask[i] = upper ? i % 3 >= i / 3 : i % 3 <= i / 3;
              const auto triangle = mul(a, a.tape().constant(mask, {3, 3}));
              const auto x = triangular_solve(a, b, {.upper = upper, .transposed = transposed});
              return batched_matmul(transposed ? transpose(triangle) : triangle, x) - b;
            }) < 1e-14);
    }
}

TEST_CASE("dual/matrices: a determinant of 2 x 2") {
  const Tensor<double> a({2, 2}, {3, 1, 2, 5}), v({2, 2}, {1, 10, 100, 1000});
  const auto det = [](auto&, auto x) { return determinant(x[0]); };
  CHECK(jvp(det, {a}, {v}).product[0] == Approx(5 * 1 - 2 * 10 - 1 * 100 + 3 * 1000).epsilon(1e-14));
  const auto h = hvp(det, {a}, {v}).products[0];  // H swaps a with d, and -b with c
  const std::vector<double> want{1000, -100, -10, 1};
  for (Index i = 0; i < 4; ++i) CHECK(h[i] == Approx(want[at(i)]).epsilon(1e-11));
  const Tensor<double> singular({2, 2}, {1, 2, 2, 4});
  CHECK_THROWS_WITH(jvp(det, {singular}, {v}), Contains("singular"));
}

TEST_CASE("dual/matrices: the tangent for all operands is the sum of those for one") {
  const auto rows = uniform({4, 3}, -1, 1, 1), matrix = uniform({3, 5}, -1, 1, 2),
             bias = uniform({5}, -1, 1, 3);
  const auto image = uniform({2, 3, 4, 2}, -1, 1, 4), window = uniform({3, 3, 2, 5}, -1, 1, 5);
  const auto check = [](const auto& f, const std::vector<Tensor<double>>& x) {
    std::vector<Tensor<double>> v;
    for (const auto& t : x) v.push_back(uniform(t.shape, -1, 1, 9));
    const auto all = jvp<double>(f, x, v);
    Tensor<double> parts(all.product.shape);
    for (std::size_t k = 0; k < x.size(); ++k) {
      auto only = v;
      for (std::size_t j = 0; j < x.size(); ++j)
        if (j != k) only[j] = Tensor<double>(x[j].shape);
      const auto part = jvp<double>(f, x, only).product;
      for (Index i = 0; i < parts.size(); ++i) parts[i] += part[i];
    }
    double worst = 0;
    for (Index i = 0; i < parts.size(); ++i) raise_to(worst, std::abs(parts[i] - all.product[i]));
    CHECK(worst < 1e-14);
  };
  check([](auto&, auto x) { return matmul(x[0], x[1]); }, {rows, matrix});
  check([](auto&, auto x) { return dense(x[0], x[1], x[2], Activation::relu); }, {rows, matrix, bias});
  check([](auto&, auto x) { return conv2d(x[0], x[1], x[2], Activation::relu); }, {image, window, bias});
  check([](auto&, auto x) { return conv2d(x[0], x[1], x[2], {.stride = 2, .padding = 1}); },
        {image, window, bias});
  check([](auto&, auto x) { return batched_matmul(x[0], x[1]); }, {rows, uniform({2, 3, 5}, -1, 1, 6)});
}

TEST_CASE("dual/matrices: operands that are Vars cost no tangent") {
  const auto rows = uniform({4, 3}, -1, 1, 1), matrix = uniform({3, 5}, -1, 1, 2),
             bias = uniform({5}, -1, 1, 3);
  const auto image = uniform({2, 3, 4, 2}, -1, 1, 4), window = uniform({3, 3, 2, 5}, -1, 1, 5);
  Tape<double> tape;
  const Var<double> r = tape.constant(rows), m = tape.constant(matrix), b = tape.constant(bias),
                    i = tape.constant(image), w = tape.constant(window);
  const Dual<double> dual_rows(r, r), dual_matrix(m, m), dual_bias(b, b), dual_image(i, i), dual_window(w, w);
  const auto same = [](Var<double> x, Var<double> y) {
    double worst = x.shape() == y.shape() ? 0 : 1;
    for (Index k = 0; k < x.shape().size(); ++k) raise_to(worst, std::abs(x.value()[k] - y.value()[k]));
    return worst < 1e-14;
  };
  // With a tangent equal to the value, a product's tangent is the product, a bias's is the bias.
  CHECK(same(matmul(dual_rows, m).tangent(), matmul(r, m)));
  CHECK(same(matmul(r, dual_matrix).tangent(), matmul(r, m)));
  CHECK(same(batched_matmul(dual_rows, m).tangent(), matmul(r, m)));
  CHECK(same(dense(dual_rows, m, b).tangent(), matmul(r, m)));
  CHECK(same(dense(r, dual_matrix, b).tangent(), matmul(r, m)));
  CHECK(same(dense(r, m, dual_bias).tangent(), broadcast_to(b, {4, 5})));
  CHECK(same(conv2d(dual_image, w, b).tangent(), conv2d(i, w, b) - b));
  CHECK(same(conv2d(i, dual_window, b, {.padding = 1}).tangent(), conv2d(i, w, b) - b));
  CHECK(same(conv2d(i, w, dual_bias).tangent(), broadcast_to(b, {2, 3, 4, 5})));
}

TEST_CASE("dual/matrices: in float as in double") {
  const std::vector<Tensor<float>> in{far_from_singular<float>(2, 3), uniform<float>({2, 3, 2}, -1, 1, 2)};
  const auto check = [&](const auto& f) {
    CHECK(float_products_error([&](auto&, auto v) { return f(v[0], v[1]); }, in) < 1e-5);
  };
  check([](auto a, auto b) { return solve(a, b); });
  check([](auto a, auto b) { return triangular_solve(a, b); });
  check([](auto a, auto b) { return batched_matmul(inverse(a), b); });
  check([](auto a, auto) { return cholesky(a); });
  check([](auto a, auto) { return determinant(a) + log_determinant(a); });
  check([](auto a, auto b) { return matmul(reshape(a, {6, 3}), reshape(b, {3, 4})); });
  const std::vector<Tensor<float>> layer{uniform<float>({2, 3, 4, 2}, -1, 1, 4),
                                         uniform<float>({3, 3, 2, 5}, -1, 1, 5),
                                         uniform<float>({5}, -1, 1, 3)};
  CHECK(float_products_error([](auto&, auto x) { return conv2d(x[0], x[1], x[2]); }, layer) < 1e-5);
  CHECK(float_products_error(
            [](auto&, auto x) { return conv2d(x[0], x[1], x[2], {.stride = 2, .padding = 1}); }, layer) <
        1e-5);
  const std::vector<Tensor<float>> rows{uniform<float>({4, 3}, -1, 1, 1), uniform<float>({3, 5}, -1, 1, 2),
                                        uniform<float>({5}, -1, 1, 3)};
  CHECK(float_products_error([](auto&, auto x) { return dense(x[0], x[1], x[2]); }, rows) < 1e-5);
}
