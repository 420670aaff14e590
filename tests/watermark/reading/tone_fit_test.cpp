#include "tone_fit.h"
#include <fieldmark/core/error.h>
#include <fieldmark/distort/distortion.h>
#include <fieldmark/engine/parallel.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
double worst_of(const Tensor<float>& a, const Tensor<float>& b, Index from = 0) {
  double worst = 0;
  for (Index i = from; i < a.size(); ++i) raise_to(worst, std::abs(static_cast<double>(a[i] - b[i])));
  return worst;
}
}  // namespace

TEST_CASE("tone_fit: gain, offset and gamma are found where the weight is") {
  const Tensor<float> render = uniform<float>({20, 20, 3}, 0.05, 1, 1);
  Tensor<float> image = render;
  std::vector<double> weight(400, 1);
  for (Index p = 0; p < 400; ++p) {
    image[3 * p] = 0.8f * render[3 * p] + 0.1f;
    image[3 * p + 1] = std::pow(render[3 * p + 1], 1.2f);
    if (p < 100) {
      weight[static_cast<std::size_t>(p)] = 0;
      for (Index c = 0; c < 3; ++c) image[3 * p + c] = 0;
    }
  }
  const ToneFit fit = fit_tones(render, image, weight);
  CHECK(worst_of(fit(render), image, 300) < 0.001);
  CHECK(fit.terms[2][3] == Approx(1));
}

// The mark is 0.01 to 0.02.
TEST_CASE("tone_fit: powers are found to less than the size of a mark") {
  const Tensor<float> render = uniform<float>({30, 30, 3}, 0, 1, 3);
  for (const auto& [power, bound] : {std::pair{2.2, 0.001}, {1.5, 0.001}, {0.7, 0.0015}, {0.5, 0.004}}) {
    Tensor<float> image = render;
    for (float& v : image.data) v = static_cast<float>(std::pow(static_cast<double>(v), power));
    const Tensor<float> toned = fit_tones(render, image, std::vector<double>(900, 1))(render);
    double squares = 0;
    for (Index i = 0; i < image.size(); ++i)
      squares += std::pow(static_cast<double>(toned[i] - image[i]), 2) / static_cast<double>(image.size());
    CAPTURE(power, std::sqrt(squares));
    CHECK(std::sqrt(squares) < bound);
  }
}

TEST_CASE("tone_fit: a constant render keeps its gain") {
  const Tensor<float> render({8, 8, 3}, 0.5f), image({8, 8, 3}, 0.6f);
  const ToneFit fit = fit_tones(render, image, std::vector<double>(64, 1));
  CHECK(worst_of(fit(render), image) < 1e-5);
  const float v[] = {0.5f, 0.5f, 0.5f};
  const auto slope = fit.slope(v);
  for (std::size_t c = 0; c < 3; ++c) {
    CAPTURE(c);
    CHECK(slope[c][c] > 0.9);
    CHECK(slope[c][c] < 1.3);
  }
}

TEST_CASE("tone_fit: channels that are mixed are found: greyscale, sepia, hue turned by 180 degrees") {
  const Tensor<float> render = uniform<float>({30, 30, 3}, 0, 1, 2);
  const std::vector<double> weight(900, 1);
  const std::vector<float> white(3, 1.f);
  for (const char* name : {"greyscale", "hue_180"}) {
    CAPTURE(name);
    const auto image =
        distort::apply_distortion(distort::parse_distortion(name), render, CounterRng(1, 1), 0, white);
    CHECK(worst_of(fit_tones(render, image, weight)(render), image) < 0.015);
  }
  Tensor<float> sepia(render.shape);
  constexpr float kSepia[3][3] = {
      {0.393f, 0.769f, 0.189f}, {0.349f, 0.686f, 0.168f}, {0.272f, 0.534f, 0.131f}};
  for (Index i = 0; i < render.size(); ++i) {
    const auto& row = kSepia[i % 3];
    const float* v = &render.data[static_cast<std::size_t>(i / 3 * 3)];
    sepia[i] = 0.7f * (row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
  }
  CHECK(worst_of(fit_tones(render, sepia, weight)(render), sepia) < 0.01);
}

TEST_CASE("tone_fit: the slope is that of the curve") {
  ToneFit fit;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k < ToneFit::kTerms; ++k)
      fit.terms[c][k] = 0.1 * static_cast<double>(c) + 0.3 * static_cast<double>(k) - 0.4;
  const float v[] = {0.5f, 0.25f, 0.75f}, h = 1.f / 1024;
  const auto slope = fit.slope(v);
  for (std::size_t k = 0; k < 3; ++k) {
    float up[] = {v[0], v[1], v[2]}, down[] = {v[0], v[1], v[2]};
    up[k] += h;
    down[k] -= h;
    const auto a = fit.at(up), b = fit.at(down);
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(slope[c][k] == Approx((a[c] - b[c]) / (2 * static_cast<double>(h))).epsilon(1e-4));
  }
}

TEST_CASE("tone_fit: without weight nothing changes, black included") {
  const Tensor<float> render = uniform<float>({4, 4, 3}, 0, 1, 1), image({4, 4, 3}, 0.3f);
  const ToneFit fit = fit_tones(render, image, std::vector<double>(16));
  CHECK(fit(render).data == render.data);
  const float black[] = {0, 0, 0};
  CHECK(fit.at(black) == std::array<double, 3>{0, 0, 0});
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k < 3; ++k) CHECK(fit.slope(black)[c][k] == (c == k ? 1 : 0));
}

TEST_CASE("tone_fit: one and two threads give the same bits") {
  const Tensor<float> render = uniform<float>({50, 60, 3}, 0, 1, 1),
                      image = uniform<float>({50, 60, 3}, 0, 1, 2);
  const std::vector<double> weight(3000, 0.7);
  const ScopedThreads serial(1);
  const ToneFit one = fit_tones(render, image, weight);
  const Tensor<float> toned = one(render);
  const ScopedThreads parallel(2);
  CHECK(fit_tones(render, image, weight).terms == one.terms);
  CHECK(one(render).data == toned.data);
}

// A twentieth of the pixels is white, as under a caption: the plain fit bends by ten levels of 255.
TEST_CASE("tone_fit: a robust fit ignores pixels that differ by far more than the rest") {
  const Tensor<float> render = uniform<float>({40, 40, 3}, 0.1, 0.9, 4),
                      noise = uniform<float>({40, 40, 3}, -0.004, 0.004, 5);
  Tensor<float> image = render;
  std::vector<double> weight(1600, 1);
  for (Index p = 0; p < 1600; ++p)
    for (Index c = 0; c < 3; ++c)
      image[3 * p + c] = p < 80 ? 1 : 0.7f * render[3 * p + c] + 0.1f + noise[3 * p + c];
  const auto rms = [&](const Tensor<float>& toned) {
    double squares = 0;
    for (Index i = 240; i < image.size(); ++i)
      squares += std::pow(static_cast<double>(toned[i] - 0.7f * render[i] - 0.1f), 2) /
                 static_cast<double>(image.size() - 240);
    return std::sqrt(squares);
  };
  const RobustTones one = fit_tones_robustly(render, image, weight, 1),
                    three = fit_tones_robustly(render, image, weight, 3);
  CHECK(one.toned.data == fit_tones(render, image, weight)(render).data);
  CAPTURE(rms(one.toned), rms(three.toned));
  CHECK(rms(one.toned) > 0.02);
  CHECK(rms(three.toned) < 0.001);
  CHECK(three.spread > 0.002);
  CHECK(three.spread < 0.005);
  CHECK(three.rest[0] == static_cast<double>(image[0]) - static_cast<double>(three.toned[0]));
  const RobustTones none = fit_tones_robustly(render, image, std::vector<double>(1600), 2);
  CHECK(none.toned.data == render.data);
  CHECK(none.spread == 0);
}

TEST_CASE("tone_fit: errors name the shapes") {
  const Tensor<float> render({4, 4, 3}), other({4, 5, 3});
  CHECK_THROWS_WITH(fit_tones(render, other, std::vector<double>(16)),
                    "[fit_tones] image and weight must fit the render [4, 4, 3], got shape [4, 5, 3] and 16 "
                    "weights");
  CHECK_THROWS_AS(fit_tones(render, render, std::vector<double>(15)), ShapeError);
  CHECK_THROWS_AS(fit_tones(Tensor<float>({4, 4}), Tensor<float>({4, 4}), std::vector<double>(16)),
                  ShapeError);
}
