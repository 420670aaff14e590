#include "residual_signs.h"
#include "carriers.h"
#include "jpeg_score.h"
#include "plain_border.h"
#include "sign_fit.h"
#include "tone_fit.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "blurred.h"
#include "ordered_sum.h"

namespace fieldmark::watermark {
namespace {

constexpr Index kSamples = 4;          // per ray
constexpr double kFarFromLeast = 1.2;  // of the least residual: beyond, the search for a blur ends
constexpr double kBlurs[] = {0, 0.4, 0.6, 0.8, 1, 1.25, 1.5, 2, 2.5, 3};  // standard deviations tried, pixels
constexpr int kPasses = 2;
constexpr double kAround = 4;           // standard deviation of the window for the local power, pixels
constexpr float kLeastNoise = 1.2e-6f;  // variance of rounding to 8 bits
constexpr double kStrongBlur = 1;       // pixels: an image with more has lost detail

// The unmarked render in the image's blur and tones, and the residual.
struct Shown {
  Tensor<float> render, rest;
  double blur = 0, left = 0;
  ToneFit tones{};
};

Shown shown_with(const Tensor<float>& image, const Tensor<float>& base, const std::vector<double>& object,
                 double blur) {
  const Tensor<float> soft = blurred(base, blur);
  const ToneFit tones = fit_tones(soft, image, object);
  Shown s{.render = tones(soft), .rest = Tensor<float>(image.shape), .blur = blur, .tones = tones};
  s.left = ordered_sum(std::ssize(object), 0.0, [&](Index begin, Index end, double& part) {
    for (Index i = 3 * begin; i < 3 * end; ++i) {
      s.rest[i] = image[i] - s.render[i];
      part += object[at(i / 3)] * static_cast<double>(s.rest[i] * s.rest[i]);
    }
  });
  return s;
}

Shown shown(const Tensor<float>& image, const Tensor<float>& base, const std::vector<double>& object) {
  Shown best = shown_with(image, base, object, kBlurs[0]);
  for (const double blur : std::span(kBlurs).subspan(1)) {
    Shown s = shown_with(image, base, object, blur);
    if (s.left < best.left)
      best = std::move(s);
    else if (s.left > kFarFromLeast * best.left)
      break;
  }
  RobustTones fit = fit_tones_robustly(blurred(base, best.blur), image, object, kPasses);
  best.tones = fit.tones;
  best.render = std::move(fit.toned);
  for (std::size_t i = 0; i < fit.rest.size(); ++i) best.rest.data[i] = static_cast<float>(fit.rest[i]);
  return best;
}

// Takes the local power of the residual, mark included, as the noise.
void score_differences(const Tensor<float>& rest, MarkScore& s) {
  Tensor<float> power = rest;
  for (float& x : power.data) x *= x;
  power = blurred(power, kAround);
  for (Index i = 0; i < power.size(); ++i) {
    s.precision[i] = 1 / (std::max(power[i], 0.f) + kLeastNoise);
    s.score[i] = rest[i] * s.precision[i];
  }
}

// JpegScore's information is per block, so all channels of a pixel get the same precision.
void use_jpeg(JpegScore&& jpeg, const Tensor<float>& mark, MarkScore& s) {
  s.score = std::move(jpeg.score);
  for (Index p = 0; p < mark.size() / 3; ++p) {
    float information = 0, power = 0;
    for (Index i = 3 * p; i < 3 * p + 3; ++i) {
      information += jpeg.information[i];
      power += mark[i] * mark[i];
    }
    for (Index i = 3 * p; i < 3 * p + 3; ++i) s.precision[i] = power > 0 ? information / power : 0;
  }
}

// Computes the score, and adapts the carriers to the image's colours.
MarkScore score_of(const Tensor<float>& image, const CachedView& view, Carriers& carriers,
                   const std::vector<std::uint8_t>& border, const std::optional<JpegTrace>& jpeg) {
  MarkScore s{.score = Tensor<float>(image.shape), .precision = Tensor<float>(image.shape), .on_object = {}};
  for (const float opacity : view.opacity.data) s.on_object.push_back(opacity > 0.5f ? 1 : 0);
  for (std::size_t p = 0; p < border.size(); ++p)
    if (border[p]) s.on_object[p] = 0;
  const Shown seen = shown(image, view.base, s.on_object);
  s.blur = seen.blur;
  change_colours(carriers, view.base, seen.tones);
  const Tensor<float>& mark = carriers.whole;
  if (!jpeg) {
    score_differences(seen.rest, s);
    return s;
  }
  const Tensor<float> soft = blurred(mark, seen.blur);
  JpegScore score = jpeg_score(image, seen.render, soft, s.on_object, *jpeg);
  if (seen.blur > 0) {  // quantisation removes detail as blur does
    JpegScore sharp =
        jpeg_score(image, shown_with(image, view.base, s.on_object, 0).render, mark, s.on_object, *jpeg);
    if (sharp.log_likelihood > score.log_likelihood) {
      s.blur = 0;
      use_jpeg(std::move(sharp), mark, s);
      return s;
    }
  }
  use_jpeg(std::move(score), soft, s);
  return s;
}

}  // namespace

ResidualSigns residual_signs(nerf::Renderer& renderer, const Owner& owner, const EvidenceView& image) {
  const Surround& seen = image.seen;
  const CachedView view = cache_view(renderer, owner.field, image.camera, kSamples);
  Carriers mark = carriers(owner, view);
  const Tensor<float> shown = seen.plain.size() > 0
                                  ? before_background(seen.plain, view.opacity, seen.colour,
                                                      nerf::background_value(owner.field.background))
                                  : seen.image;
  const auto border = seen.covered.empty() ? border_of(owner.field, shown) : seen.covered;
  const MarkScore score = score_of(shown, view, mark, border, image.jpeg);
  return {.sign = fit_signs(mark, score, owner.cells.count()).sign,
          .lost_detail = image.jpeg || image.zoom * score.blur >= kStrongBlur || image.small};
}

}  // namespace fieldmark::watermark
