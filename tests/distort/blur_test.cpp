#include <fieldmark/distort/blur.h>

#include "distort/support.h"
#include "support/each_isa.h"
#include "support/expect_grad.h"

using namespace fieldmark;
using distort::blur;

namespace {
const auto soften = [](auto&, auto v) { return blur(v[0], v[1]); };

// Computes the two-dimensional sum directly, without separating it.
Tensor<double> brute_force(const Tensor<double>& x, double sigma) {
  const Index h = x.shape[0], w = x.shape[1], channels = x.shape[2];
  const Index r = std::max<Index>(1, static_cast<Index>(std::ceil(4 * sigma)));
  Tensor<double> y(x.shape);
  for (Index i = 0; i < h; ++i)
    for (Index j = 0; j < w; ++j)
      for (Index c = 0; c < channels; ++c) {
        double sum = 0, total = 0;
        for (Index k = -r; k <= r; ++k)
          for (Index l = -r; l <= r; ++l) {
            const double weight = std::exp(-static_cast<double>(k * k + l * l) / (2 * sigma * sigma));
            total += weight;
            sum +=
                weight *
                x[(std::clamp<Index>(i + k, 0, h - 1) * w + std::clamp<Index>(j + l, 0, w - 1)) * channels +
                  c];
          }
        y[(i * w + j) * channels + c] = sum / total;
      }
  return y;
}
}  // namespace

TEST_CASE("blur: equals the two-dimensional Gaussian sum, within 1e-14") {
  for (Shape s : {Shape{9, 7, 3}, Shape{1, 1, 3}, Shape{1, 6, 1}, Shape{4, 1, 2}})
    for (double sigma : {0.3, 1.0, 2.6}) {
      const auto x = uniform(s, 0, 1, 1);
      CHECK(largest_difference(op_result<double>(soften, {x, number<double>(sigma)}), brute_force(x, sigma)) <
            1e-14);
    }
}

TEST_CASE("blur: sigma to 0 is the exact identity with a finite gradient") {
  const auto x = uniform<float>({6, 5, 3}, 0, 1, 1);
  for (double sigma : {0.0, 1e-30, 1e-6, 1e-2}) {
    CHECK(op_result<float>(soften, {x, number<float>(sigma)}).data == x.data);
    for (float v : run_with_grads<float>(soften, {x, number<float>(sigma)}, 1)) CHECK(std::isfinite(v));
    const auto grads = run_with_grads<float>(soften, {x, number<float>(sigma)}, 1);
    CHECK(grads.back() == 0);
  }
}

TEST_CASE("blur: constant images stay constant, edges too") {
  for (double sigma : {0.4, 1.0, 20.0}) {
    const auto y = op_result<float>(soften, {Tensor<float>({33, 20, 3}, 0.3f), number<float>(sigma)});
    for (float v : y.data) CHECK(std::abs(v - 0.3f) < 5e-7f);
  }
}

TEST_CASE("blur: gradient in image and sigma") {
  expect_grad(soften, {uniform({7, 6, 3}, 0, 1, 1), number<double>(0.62)});
  expect_grad(soften, {uniform({2, 3, 2}, 0, 1, 1), number<double>(1.87)});
  expect_grad(soften, {uniform({1, 1, 1}, 0, 1, 1), number<double>(0.9)});
  expect_grad(soften, {Tensor<double>({0, 3, 1}), number<double>(0.9)});
}

TEST_CASE("blur: float against double, result and gradients, for widths of 1 to 130") {
  each_isa([] {
    for (Index w = 1; w <= 130; ++w) {
      CAPTURE(w);
      CHECK(distortion_error(soften, {uniform<float>({3, w, 1 + w % 3}, 0, 1, 1), number<float>(0.8)}) <
            1e-6);
    }
  });
}

TEST_CASE("blur: errors") {
  Tape<float> tape;
  const Tensor<float> x({2, 2, 3}), minus({1}, -1.f), nan({1}, std::nanf("")), two({2});
  CHECK_THROWS_WITH(blur(tape.constant(x), tape.constant(minus)),
                    "[blur] sigma: must be in 0 to 1000 (a standard deviation in pixels), got -1");
  CHECK_THROWS_AS(blur(tape.constant(x), tape.constant(nan)), ValueError);
  CHECK_THROWS_WITH(blur(tape.constant(two), tape.constant(minus)), Contains("[blur] x must have rank 3"));
  CHECK_THROWS_AS(blur(tape.constant(x), tape.constant(two)), ShapeError);
}

TEST_CASE("blur: same bits for 1 and 2 threads") {
  const std::vector<Tensor<float>> in{uniform<float>({120, 100, 3}, 0, 1, 1), number<float>(1.3)};
  CHECK(run_with_grads<float>(soften, in, 1) == run_with_grads<float>(soften, in, 2));
}
