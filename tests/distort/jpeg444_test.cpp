#include <fieldmark/distort/jpeg444.h>
#include <fieldmark/imaging/image.h>

#include <cmath>
#include <numbers>

#include "distort/support.h"
#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using distort::jpeg444;

namespace {

double level(float v) { return 255 * static_cast<double>(v); }

double worst_level(const Tensor<float>& a, const Tensor<float>& b) {
  REQUIRE(a.shape == b.shape);
  double worst = 0;
  for (Index i = 0; i < a.size(); ++i) raise_to(worst, std::abs(level(a[i]) - level(b[i])));
  return worst;
}

// Returns an image with smooth luma, some noise and a single colour.
Tensor<float> one_colour(Index h, Index w, float blue, float red) {
  const auto noise = uniform<float>({h * w}, -0.05f, 0.05f, 3);
  Tensor<float> x({h, w, 3});
  for (Index p = 0; p < h * w; ++p) {
    const float y = 0.5f + 0.15f * std::sin(0.4f * static_cast<float>(p % w)) + noise[p];
    x[3 * p] = y + red;
    x[3 * p + 1] = y - (0.114f * blue + 0.299f * red) / 0.587f;
    x[3 * p + 2] = y + blue;
  }
  return quantize8(x);
}

}  // namespace

TEST_CASE("jpeg444: equals the encoder and decoder where chroma is even, so that its size does not matter") {
  for (const int quality : {20, 50, 75, 90})
    for (const float colour : {0.f, 0.08f}) {
      const auto x = one_colour(40, 56, colour, -colour);
      double squares = 0;
      const auto ours = jpeg444(x, quality), theirs = jpeg_round_trip(x, quality);
      for (Index i = 0; i < x.size(); ++i) squares += std::pow(level(ours[i]) - level(theirs[i]), 2);
      INFO(quality << " " << colour);
      // The decoder's transform uses integers, and a coefficient at a half may round either way.
      // Measured 0.02 to 0.15 levels rms.
      CHECK(std::sqrt(squares / static_cast<double>(x.size())) < 0.3);
    }
}

TEST_CASE("jpeg444: a wave of chroma alone keeps its amplitude to the table's step") {
  // Cb = 128 + A cos((2 x + 1) u pi / 16) in every row has one coefficient besides the mean.
  constexpr double kAmplitude = 30;
  for (const auto& [u, base] : {std::pair{1, 18}, {2, 24}, {3, 47}, {4, 99}}) {
    Tensor<float> x({16, 16, 3});
    for (Index p = 0; p < 256; ++p) {
      const double cb =
          kAmplitude * std::cos((2 * static_cast<double>(p % 8) + 1) * u * std::numbers::pi / 16);
      x[3 * p] = 128.f / 255;
      x[3 * p + 1] = static_cast<float>((128 - 0.114 * 1.772 / 0.587 * cb) / 255);
      x[3 * p + 2] = static_cast<float>((128 + 1.772 * cb) / 255);
    }
    // Without its weight of 1/2, a cosine of u > 0 has squared length 4; a uniform column gives 8 times
    // sqrt(1/8): the coefficient is A * (1/2 * 4) * (8 sqrt(1/8)).
    const double coefficient = kAmplitude * 2 * std::sqrt(8.0);
    const double kept = base * std::round(coefficient / base) / coefficient;
    const auto y = jpeg444(x, 50);
    for (Index p = 0; p < 8; ++p) {
      const double cb = kAmplitude * std::cos((2 * static_cast<double>(p) + 1) * u * std::numbers::pi / 16);
      // Blue is Y + 1.772 Cb; half a level of error in Cb, one level in Y, and the final rounding.
      CHECK(level(y[3 * p + 2]) == Approx(128 + 1.772 * kept * cb).margin(2.5));
    }
  }
}

TEST_CASE("jpeg444: chroma of single columns survives, which halved chroma blends") {
  Tensor<float> stripes({32, 32, 3});
  for (Index p = 0; p < 32 * 32; ++p) {
    stripes[p * 3] = p % 2 ? 0.4f : 0.f;
    stripes[p * 3 + 2] = p % 2 ? 0.f : 0.9f;
    stripes[p * 3 + 1] = p % 2 ? 0.f : 0.029f;
  }
  const Index middle = (16 * 32 + 16) * 3;
  const auto full = jpeg444(stripes, 90), half = jpeg_round_trip(stripes, 90);
  CHECK(full[middle + 2] - full[middle + 5] > 0.6f);
  CHECK(half[middle + 2] - half[middle + 5] < 0.2f);
}

TEST_CASE("jpeg444: even images, quality, thread count and errors") {
  const Tensor<float> grey({5, 3, 3}, 128.f / 255);
  CHECK(jpeg444(grey, 1).data == grey.data);
  const auto x = quantize8(uniform<float>({43, 29, 3}, 0, 1, 1));
  double last = 1e9;
  for (const int quality : {1, 10, 50, 90, 100}) {
    double squares = 0;
    const auto y = jpeg444(x, quality);
    for (Index i = 0; i < x.size(); ++i) squares += std::pow(level(y[i]) - level(x[i]), 2);
    CHECK(squares < last);
    last = squares;
  }
  // At quality 100 every table entry is 1: coefficients, components and colours are rounded.
  CHECK(worst_level(jpeg444(x, 100), x) <= 5);
  CHECK(jpeg444(quantize8(uniform<float>({1, 1, 3}, 0, 1, 2)), 50).shape == Shape{1, 1, 3});
  const ScopedThreads serial(1);
  const auto one = jpeg444(x, 50);
  const ScopedThreads parallel(2);
  CHECK(jpeg444(x, 50).data == one.data);
  CHECK_THROWS_WITH(jpeg444(Tensor<float>({2, 2, 1}), 50),
                    "[jpeg444] image: axis 2 must be 3 (red, green and blue), got shape [2, 2, 1]");
  CHECK_THROWS_WITH(jpeg444(Tensor<float>({0, 2, 3}), 50),
                    "[jpeg444] image: must have at least one pixel, got shape [0, 2, 3]");
  CHECK_THROWS_WITH(jpeg444(x, 0), "[jpeg444] quality: must be in 1 to 100 (as libjpeg counts), got 0");
}
