#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>

#include <cmath>
#include <limits>

#include "support/catch.h"
#include "support/data.h"
#include "support/random.h"

using namespace fieldmark;

namespace {

// Wang et al.'s definition with the full 11 x 11 window at every position, and moments about the mean.
double ssim_reference(const Tensor<float>& a, const Tensor<float>& b) {
  const Index h = a.shape[0], w = a.shape[1], channels = a.shape[2];
  double total = 0, weight[11][11], norm = 0, places = 0;
  for (int y = 0; y < 11; ++y)
    for (int x = 0; x < 11; ++x)
      norm += weight[y][x] = std::exp(-((y - 5) * (y - 5) + (x - 5) * (x - 5)) / (2 * 1.5 * 1.5));
  for (Index c = 0; c < channels; ++c)
    for (Index y = 0; y + 11 <= h; ++y)
      for (Index x = 0; x + 11 <= w; ++x, ++places) {
        auto mean = [&](auto f) {
          double sum = 0;
          for (Index v = 0; v < 11; ++v)
            for (Index u = 0; u < 11; ++u) {
              const Index i = ((y + v) * w + x + u) * channels + c;
              sum += weight[v][u] / norm * f(static_cast<double>(a[i]), static_cast<double>(b[i]));
            }
          return sum;
        };
        const double ma = mean([](double p, double) { return p; }),
                     mb = mean([](double, double q) { return q; });
        const double va = mean([&](double p, double) { return (p - ma) * (p - ma); });
        const double vb = mean([&](double, double q) { return (q - mb) * (q - mb); });
        const double cov = mean([&](double p, double q) { return (p - ma) * (q - mb); });
        total += (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
      }
  return total / places;
}

}  // namespace

TEST_CASE("metrics: one step of 1/255 everywhere is 48.13 dB, rounding to 8 bits comes first") {
  const Tensor<float> a({4, 5, 3}, 100 / 255.0f), b({4, 5, 3}, 101 / 255.0f);
  CHECK(std::abs(psnr(a, b) - 20 * std::log10(255.0)) < 1e-12);
  const Tensor<float> nearly({4, 5, 3}, 100.4f / 255);
  CHECK(psnr(a, nearly) == std::numeric_limits<double>::infinity());
  CHECK(mse(a, nearly) > 0);
  const Tensor<float> black({1, 1, 3}, -3), white({1, 1, 3}, 7);
  CHECK(psnr(black, white) == 0);
}

TEST_CASE("metrics: psnr of noise equals the double sum over rounded images") {
  const auto a = uniform<float>({31, 17, 3}, 0, 1, 1), b = uniform<float>({31, 17, 3}, 0, 1, 2);
  double sum = 0;
  for (Index i = 0; i < a.size(); ++i)
    sum += std::pow(std::floor(double(a[i]) * 255 + 0.5) - std::floor(double(b[i]) * 255 + 0.5), 2);
  const double want = 10 * std::log10(255.0 * 255.0 * double(a.size()) / sum);
  CHECK(std::abs(psnr(a, b) - want) < 1e-12);
}

TEST_CASE("metrics: the mask chooses pixels, an empty one gives NaN") {
  Tensor<float> a({2, 3, 2}), b({2, 3, 2}), mask({2, 3});
  for (Index i = 0; i < a.size(); ++i) b[i] = static_cast<float>(i / 2 * 10) / 255;
  mask.data = {0, 0.5f, 0.51f, 1, std::nanf(""), 0};
  // Pixels 2 and 3: differences 20 and 30.
  CHECK(std::abs(psnr_masked(a, b, mask) - 10 * std::log10(255.0 * 255 / ((400 + 900) / 2.0))) < 1e-12);
  CHECK(psnr_masked(a, b, Tensor<float>({2, 3}, 1)) == psnr(a, b));
  CHECK(std::isnan(psnr_masked(a, b, Tensor<float>({2, 3}))));
  CHECK(psnr_masked(a, a, mask) == std::numeric_limits<double>::infinity());
}

TEST_CASE("metrics: sums over 18 million numbers keep 14 digits") {
  // A plain float sum of as many terms would stop growing at 2^24 times the term.
  Tensor<float> a({6000, 3000, 1}, 0.1f), b({6000, 3000, 1});
  const double term = static_cast<double>(0.1f) * static_cast<double>(0.1f);
  // Measured: 2.4e-15; a running sum in double is off by 1.8e-10.
  CHECK(std::abs(mse(a, b) / term - 1) < 5e-15);
  a.data.assign(a.data.size(), 1);
  b.data.assign(b.data.size(), 254 / 255.0f);
  CHECK(std::abs(psnr(a, b) - 20 * std::log10(255.0)) < 1e-12);
}

TEST_CASE("metrics: ssim equals the definition with the full window") {
  for (const Shape& s : {Shape{11, 11, 1}, Shape{14, 19, 3}, Shape{27, 12, 2}}) {
    const auto a = uniform<float>(s, 0, 1, 1);
    auto b = uniform<float>(s, 0, 1, 2);
    for (Index i = 0; i < b.size(); ++i) b[i] = 0.7f * a[i] + 0.3f * b[i];
    CHECK(std::abs(ssim(a, b) - ssim_reference(a, b)) < 1e-13);
    CHECK(std::abs(ssim(a, a) - 1) < 1e-14);
    CHECK(std::abs(ssim(a, b) - ssim(b, a)) < 1e-15);
  }
}

// Protocol: 8-bit PNG / 255, per channel, numpy 1.24 in double, the 11 x 11 window as one outer product of
// exp(-k^2 / (2 1.5^2)) scaled to sum 1, moments E[x^2] - E[x]^2 at the positions inside the image
// (sliding_window_view and einsum), mean over positions and channels.
TEST_CASE("metrics: ssim of six pairs equals what numpy computes") {
  const auto folder = data_or_skip("lpips_reference", "SSIM against numpy");
  if (!folder) return;
  const std::pair<const char*, double> pairs[] = {
      {"lego400_blur", 0.894155277437},       {"lego400_noise", 0.407619879548},
      {"chair201x193_tone", 0.996027737976},  {"fern504x378_jpeg15", 0.766610769419},
      {"official_ex_ref_p0", 0.436746146820}, {"official_ex_ref_p1", 0.295903146654}};
  for (const auto& [name, want] : pairs) {
    CAPTURE(name);
    const auto a = read_image(*folder / (std::string(name) + "_a.png")),
               b = read_image(*folder / (std::string(name) + "_b.png"));
    // Images are float: measured at most 1.9e-8 (lego400_noise), 2e-9 without that pair.
    CHECK(std::abs(ssim(a, b) - want) < 1e-7);
  }
}

TEST_CASE("metrics: ssim of constant and opposite images") {
  const Tensor<float> dark({20, 20, 3}, 0.25f), light({20, 20, 3}, 0.75f);
  // Only the means differ; the variances round to below 1e-16 against c2 = 9e-4.
  CHECK(std::abs(ssim(dark, light) - (2 * 0.25 * 0.75 + 1e-4) / (0.0625 + 0.5625 + 1e-4)) < 1e-12);
  auto board = Tensor<float>({20, 20, 1});
  auto inverse = board;
  for (Index i = 0; i < board.size(); ++i) {
    board[i] = static_cast<float>((i / 20 + i) % 2);
    inverse[i] = 1 - board[i];
  }
  CHECK(ssim(board, inverse) < -0.99);
}

TEST_CASE("metrics: thread count and errors") {
  const auto a = uniform<float>({200, 100, 3}, 0, 1, 1), b = uniform<float>({200, 100, 3}, 0, 1, 2);
  const ScopedThreads serial(1);
  const double m = mse(a, b), s = ssim(a, b);
  const ScopedThreads parallel(2);
  CHECK(mse(a, b) == m);
  CHECK(ssim(a, b) == s);
  CHECK_THROWS_WITH(psnr(a, Tensor<float>({2, 2, 3})),
                    "[psnr] b must have the shape of a, [200, 100, 3], got shape [2, 2, 3]");
  CHECK_THROWS_WITH(mse(Tensor<float>(), Tensor<float>()), Contains("[mse] a must not be empty"));
  CHECK_THROWS_WITH(ssim(Tensor<float>({10, 30, 3}), Tensor<float>({10, 30, 3})),
                    "[ssim] a: height and width must be at least 11 (the window's), got shape [10, 30, 3]");
  CHECK_THROWS_WITH(psnr_masked(a, b, Tensor<float>({200, 99})),
                    "[psnr_masked] mask: axis 1 must be 100 (the image's width), got shape [200, 99]");
}
