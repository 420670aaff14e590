#include "tone_fit.h"
#include <fieldmark/core/error.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

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
  double worst = 0;
  for (Index i = 300; i < 1200; ++i)
    raise_to(worst, std::abs(fit.at(i % 3, static_cast<double>(render[i])) - static_cast<double>(image[i])));
  CHECK(worst < 0.04);  // measured 0.027, of the gamma: three terms do not make a power, and 1% is held back
  CHECK(fit.gain[2] == Approx(1));
  CHECK(fit.slope(0, 0.5) == Approx((fit.at(0, 0.5001) - fit.at(0, 0.4999)) / 2e-4).epsilon(1e-6));
}

TEST_CASE("tone_fit: without weight nothing changes, black included") {
  const Tensor<float> render = uniform<float>({4, 4, 3}, 0, 1, 1), image({4, 4, 3}, 0.3f);
  const ToneFit fit = fit_tones(render, image, std::vector<double>(16));
  for (Index c = 0; c < 3; ++c) {
    CHECK(fit.at(c, 0.25) == 0.25);
    CHECK(fit.at(c, 0) == 0);
    CHECK(fit.slope(c, 0) == 1);
  }
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
