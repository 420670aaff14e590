#include <fieldmark/core/error.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/colour_fit.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
constexpr Index kWidth = 20, kHeight = 12, kPixels = kWidth * kHeight;

// Returns a render with colours, opacities and gaps, over white.
Rendering some_render() {
  Rendering r{.rgb = Tensor<float>({kHeight, kWidth, 3}),
              .opacity = uniform<float>({kHeight, kWidth}, 0, 1, 2)};
  const auto colour = uniform<float>({kPixels, 3}, 0.1, 0.6, 1);
  for (Index i = 0; i < kPixels; ++i)
    for (Index k = 0; k < 3; ++k) r.rgb[3 * i + k] = r.opacity[i] * colour[3 * i + k] + 1 - r.opacity[i];
  return r;
}

// Returns a ground truth that shows the render with different gains and offsets in each half.
View view_of(const Rendering& r, float left_gain, float right_gain, float offset) {
  View view{.camera = {.width = kWidth, .height = kHeight},
            .rgba = Tensor<float>({kHeight, kWidth, 4}),
            .name = "v"};
  for (Index i = 0; i < kPixels; ++i) {
    const float a = r.opacity[i], gain = i % kWidth < kWidth / 2 ? left_gain : right_gain;
    for (Index k = 0; k < 3; ++k)
      view.rgba[4 * i + k] = gain * (r.rgb[3 * i + k] - (1 - a)) / a + offset * static_cast<float>(k);
    view.rgba[4 * i + 3] = a;
  }
  return view;
}

double worst(const Tensor<float>& a, const Tensor<float>& b) {
  double most = 0;
  for (Index i = 0; i < a.size(); ++i) {
    const double d = std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
    most = d > most || std::isnan(d) ? d : most;
  }
  return most;
}
}  // namespace

TEST_CASE("colour_fit: gain and offset of the ground truth are found, and the background stays") {
  const Rendering r = some_render();
  const View view = view_of(r, 1.25f, 1.25f, 0.05f);
  const Tensor<float> truth = composited(view, Background::white);
  CHECK(worst(r.rgb, truth) > 0.1);
  CHECK(worst(colour_fitted(r, view, Background::white), truth) < 5e-3);  // regularising by 1e-4 costs 2e-3
}

TEST_CASE("colour_fit: each half takes the colours of the other") {
  const Rendering r = some_render();
  const Tensor<float> fitted = colour_fitted(r, view_of(r, 1.3f, 1, 0), Background::white),
                      crossed = composited(view_of(r, 1, 1.3f, 0), Background::white);
  CHECK(worst(fitted, crossed) < 5e-3);
}

TEST_CASE("colour_fit: a perfect render stays as it is, and pixels that are not valid say nothing") {
  const Rendering r = some_render();
  View view = view_of(r, 1, 1, 0);
  CHECK(worst(colour_fitted(r, view, Background::white), r.rgb) < 1e-6);
  view.valid.assign(static_cast<std::size_t>(kPixels), 1);
  for (Index i = 0; i < kPixels; i += 3) {
    view.valid[static_cast<std::size_t>(i)] = 0;
    view.rgba[4 * i] = 1 - view.rgba[4 * i];
  }
  CHECK(worst(colour_fitted(r, view, Background::white), r.rgb) < 1e-6);
  std::ranges::fill(view.valid, std::uint8_t{0});
  CHECK(worst(colour_fitted(r, view, Background::white), r.rgb) < 1e-6);
}

TEST_CASE("colour_fit: a render of another size is refused") {
  Rendering r = some_render();
  const View view = view_of(r, 1, 1, 0);
  r.rgb = Tensor<float>({2, 2, 3});
  CHECK_THROWS_WITH(colour_fitted(r, view, Background::white),
                    "[colour_fitted] render must be of the view's size [12, 20, 3], got [2, 2, 3]");
}
