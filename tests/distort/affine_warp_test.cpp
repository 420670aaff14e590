#include <fieldmark/distort/affine_warp.h>

#include <limits>

#include "distort/support.h"
#include "support/expect_grad.h"

using namespace fieldmark;
using distort::affine_warp;
using distort::warp_labels;

namespace {
const std::vector<double> kBackground{0.9, 0.1, 0.4};

// Straight from the formula: a hat function for every pair of pixels, with the background outside.
Tensor<double> brute_force(const Tensor<double>& x, const std::vector<double>& m, Index height, Index width) {
  const Index h = x.shape[0], w = x.shape[1], channels = x.shape[2];
  Tensor<double> y({height, width, channels});
  for (Index i = 0; i < height; ++i)
    for (Index j = 0; j < width; ++j) {
      const double dx = static_cast<double>(j) + 0.5 - static_cast<double>(width) / 2;
      const double dy = static_cast<double>(i) + 0.5 - static_cast<double>(height) / 2;
      const double u = m[0] * dx + m[1] * dy + m[2] + static_cast<double>(w) / 2 - 0.5;
      const double v = m[3] * dx + m[4] * dy + m[5] + static_cast<double>(h) / 2 - 0.5;
      for (Index c = 0; c < channels; ++c) {
        double covered = 0, sum = 0;
        for (Index r = 0; r < h; ++r)
          for (Index q = 0; q < w; ++q) {
            const double weight = std::max(0.0, 1 - std::abs(v - static_cast<double>(r))) *
                                  std::max(0.0, 1 - std::abs(u - static_cast<double>(q)));
            sum += weight * x[(r * w + q) * channels + c];
            covered += weight;
          }
        y[(i * width + j) * channels + c] = sum + (1 - covered) * kBackground[static_cast<std::size_t>(c)];
      }
    }
  return y;
}

const auto with_background = [](auto&, auto v) {
  return affine_warp(v[0], v[1], {.background = kBackground});
};
}  // namespace

TEST_CASE("affine_warp: equals the hat-function sum, within 1e-14") {
  for (Index channels : {1, 3}) {
    const auto x = uniform({6, 5, channels}, 0, 1, 1);
    for (unsigned seed = 2; seed < 12; ++seed) {
      const auto m = uniform({6}, -1.5, 1.5, seed);
      const auto y = op_result<double>(
          [&](auto&, auto v) {
            return affine_warp(
                v[0], v[1],
                {.height = 7,
                 .width = 4,
                 .background = std::span(kBackground).first(static_cast<std::size_t>(channels))});
          },
          {x, m});
      CHECK(largest_difference(y, brute_force(x, m.data, 7, 4)) < 1e-14);
    }
  }
}

TEST_CASE("affine_warp: whole shifts copy pixels, far and undefined positions read the background") {
  const auto x = uniform<float>({3, 4, 1}, 0, 1, 1);
  const auto f = [](auto&, auto v) {
    return affine_warp(v[0], v[1], {.background = std::vector<float>{0.25f}});
  };
  const auto y = op_result<float>(f, {x, Tensor<float>({6}, {1, 0, 1, 0, 1, -1})});
  for (Index i = 0; i < 3; ++i)
    for (Index j = 0; j < 4; ++j) CHECK(y[i * 4 + j] == (i > 0 && j < 3 ? x[(i - 1) * 4 + j + 1] : 0.25f));
  for (float bad : {std::nanf(""), 1e38f, -1e38f, std::numeric_limits<float>::infinity()})
    for (Index k = 0; k < 6; ++k) {
      Tensor<float> m({6}, {1, 0, 0, 0, 1, 0});
      m[k] = bad;
      const auto z = op_result<float>(f, {Tensor<float>({2, 2, 1}, 7.f), m});
      CHECK(z.data == std::vector<float>(4, 0.25f));
    }
}

TEST_CASE("affine_warp: gradient in image and matrix") {
  // This step avoids integer positions, where the weights have a kink.
  const GradcheckOptions options{.step = 0.02};
  expect_grad(with_background,
              {uniform({5, 6, 3}, 0, 1, 1), Tensor<double>({6}, {0.83, -0.31, 0.22, 0.27, 1.12, -0.41})},
              options);
  expect_grad([](auto&, auto v) { return affine_warp(v[0], v[1]); },
              {uniform({1, 1, 1}, 0, 1, 1), Tensor<double>({6}, {1, 0, 0.3, 0, 1, -0.2})}, options);
  expect_grad([](auto&, auto v) { return affine_warp(v[0], v[1], {.height = 2, .width = 2}); },
              {Tensor<double>({0, 3, 2}), Tensor<double>({6}, {1, 0, 0, 0, 1, 0})});
}

TEST_CASE("affine_warp: labels take the nearest pixel") {
  const Tensor<std::int32_t> labels({2, 3}, {1, 2, 3, 4, 5, 6});
  const std::vector<float> near{1, 0, 0.4f, 0, 1, -0.4f}, far{1, 0, 0.6f, 0, 1, 0};
  CHECK(warp_labels(labels, std::span<const float>(near), -1).data == labels.data);
  CHECK(warp_labels(labels, std::span<const float>(far), -1).data ==
        std::vector<std::int32_t>{2, 3, -1, 5, 6, -1});
  const auto wide = warp_labels(labels, std::span<const float>(near), -1, 2, 5);
  CHECK(wide.data == std::vector<std::int32_t>{-1, 1, 2, 3, -1, -1, 4, 5, 6, -1});
}

TEST_CASE("affine_warp: errors") {
  Tape<double> tape;
  const Tensor<double> x({2, 2, 1}), flat({2, 2}), m({6});
  CHECK_THROWS_WITH(with_background(tape, std::vector{tape.constant(x), tape.constant(m)}),
                    "[affine_warp] background: must have one element for each channel of x, whose shape is "
                    "[2, 2, 1], got 3");
  CHECK_THROWS_WITH(affine_warp(tape.constant(flat), tape.constant(m)),
                    "[affine_warp] x must have rank 3 [height, width, channels], got shape [2, 2]");
  CHECK_THROWS_WITH(affine_warp(tape.constant(x), tape.constant(flat)),
                    "[affine_warp] matrix must have rank 1 [6], got shape [2, 2]");
  const std::vector<float> five(5);
  CHECK_THROWS_WITH(warp_labels(Tensor<std::int32_t>({1, 1}), std::span<const float>(five), 0),
                    "[warp_labels] matrix: must have 6 elements, got 5");
  CHECK_THROWS_AS(warp_labels(Tensor<std::int32_t>({1}), std::span<const float>(five), 0), ShapeError);
}

TEST_CASE("affine_warp: same bits for 1 and 2 threads") {
  for (Index channels : {2, 3}) {
    const std::vector<Tensor<float>> in{uniform<float>({120, 130, channels}, 0, 1, 1),
                                        Tensor<float>({6}, {0.9f, -0.3f, 0.2f, 0.3f, 0.9f, 0.1f})};
    const auto f = [](auto&, auto v) { return affine_warp(v[0], v[1]); };
    CHECK(run_with_grads<float>(f, in, 1) == run_with_grads<float>(f, in, 2));
  }
}
