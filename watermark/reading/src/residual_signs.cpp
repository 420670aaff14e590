#include "residual_signs.h"
#include "carriers.h"
#include "colour_axes.h"
#include "jpeg_score.h"
#include "plain_border.h"
#include "sign_fit.h"
#include "tone_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>

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
// Share of the residual that the mark explains, below which the residual's colours are those of noise: 0.14
// to 0.53 in untouched views of lego and wires, 0.02 to 0.05 after fine-tuning on clean images.
constexpr double kMostlyNoise = 0.1;
constexpr double kStrongBlur = 1;  // pixels: an image with more has lost detail

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

Tensor<float> power_around(const Tensor<float>& rest) {
  Tensor<float> power = rest;
  for (float& x : power.data) x *= x;
  power = blurred(power, kAround);
  for (float& x : power.data) x = std::max(x, 0.f);
  return power;
}

// Takes the local power of the residual, mark included, as the noise.
void score_differences(const Tensor<float>& rest, MarkScore& s) {
  const Tensor<float> power = power_around(rest);
  for (Index i = 0; i < power.size(); ++i) {
    s.precision[i] = 1 / (power[i] + kLeastNoise);
    s.score[i] = rest[i] * s.precision[i];
  }
}

// Scores the residual along axes of colour in which it is uncorrelated.
void turn_colours(MarkScore& s, Carriers& mark) {
  Tensor<float> rest = s.score;
  for (Index i = 0; i < rest.size(); ++i) rest[i] /= s.precision[i];
  const ColourAxes axes = uncorrelated_axes(rest, power_around(rest), s.on_object);
  turn(rest.data, axes);
  turn(mark.whole.data, axes);
  turn(mark.part, axes);
  score_differences(rest, s);
}

// Returns the renders that a compressed image may show over this base: in the blur and the tones that fit
// best, in the tones alone, in the blur alone, and as they are. Quantisation removes detail as blur does, and
// bends the tones that fit.
std::vector<Shown> possible(const Tensor<float>& image, const Tensor<float>& base,
                            const std::vector<double>& object) {
  std::vector<Shown> all{shown(image, base, object)};
  const double blur = all[0].blur;
  if (blur > 0) {
    all.push_back(shown_with(image, base, object, 0));
    all.push_back({.render = blurred(base, blur), .rest = {}, .blur = blur});
  }
  all.push_back({.render = base, .rest = {}});
  return all;
}

// The likeliest render, and the colours that its tones changed.
struct Likeliest {
  Shown shown;
  Tensor<float> base;
};

// A plain background of another colour was changed with the tones, or put there.
Likeliest likeliest(const Surround& seen, const CachedView& render, float level,
                    const std::vector<double>& object, const JpegImage& jpeg) {
  std::vector<Tensor<float>> bases{render.base};
  if (seen.plain.size() > 0)
    bases.push_back(before_background(render.base, render.opacity, {level, level, level}, seen.colour));
  Likeliest best;
  double most = std::numeric_limits<double>::lowest();
  for (const Tensor<float>& base : bases)
    for (Shown& s : possible(own_image(seen), base, object)) {
      const double found = jpeg.log_likelihood(s.render);
      if (!(found > most)) continue;
      most = found;
      best = {std::move(s), base};
    }
  return best;
}

// Leaves out the blocks of which a pixel is covered: their coefficients are of the cover, too.
void leave_out_blocks(const std::vector<std::uint8_t>& covered, Index w, const JpegTrace& jpeg,
                      std::vector<double>& on_object) {
  constexpr Index kBlock = 16;  // pixels, of halved chroma
  const Index across = w / kBlock + 2;
  const auto block = [&](std::size_t p) {  // the first may be cut
    const Index y = static_cast<Index>(p) / w + kBlock - jpeg.top,
                x = static_cast<Index>(p) % w + kBlock - jpeg.left;
    return at(y / kBlock * across + x / kBlock);
  };
  std::vector<std::uint8_t> out(block(on_object.size() - 1) + at(across));
  for (std::size_t p = 0; p < covered.size(); ++p)
    if (covered[p]) out[block(p)] = 1;
  for (std::size_t p = 0; p < on_object.size(); ++p)
    if (out[block(p)]) on_object[p] = 0;
}

std::vector<double> pixels_on_object(const CachedView& render, const std::vector<std::uint8_t>& border) {
  std::vector<double> on_object;
  for (const float opacity : render.opacity.data) on_object.push_back(opacity > 0.5f ? 1 : 0);
  for (std::size_t p = 0; p < border.size(); ++p)
    if (border[p]) on_object[p] = 0;
  return on_object;
}

// Returns the image with its plain background exchanged for the field's.
Tensor<float> before_own_background(const Surround& seen, const CachedView& render, float level) {
  if (seen.plain.size() == 0) return seen.image;
  return before_background(seen.plain, render.opacity, seen.colour, {level, level, level});
}

// Computes the score, and adapts the carriers to the image's colours.
MarkScore score_of(const EvidenceView& view, const CachedView& render, const nerf::RadianceField& field,
                   Carriers& carriers) {
  const Surround& seen = view.seen;
  const float level = nerf::background_value(field.background);
  const Shape& shape = seen.image.shape;
  MarkScore s{.score = Tensor<float>(shape),
              .precision = Tensor<float>(shape),
              .on_object = pixels_on_object(
                  render, seen.covered.empty() ? border_of(field, seen.image) : seen.covered)};
  if (!view.jpeg) {
    const Shown fitted = shown(before_own_background(seen, render, level), render.base, s.on_object);
    s.blur = fitted.blur;
    change_colours(carriers, render.base, fitted.tones);
    score_differences(fitted.rest, s);
    return s;
  }
  leave_out_blocks(seen.covered, render.width, *view.jpeg, s.on_object);
  const JpegImage jpeg(own_image(seen), s.on_object, *view.jpeg);
  const Likeliest best = likeliest(seen, render, level, s.on_object, jpeg);
  s.blur = best.shown.blur;
  change_colours(carriers, best.base, best.shown.tones);
  JpegScore score = jpeg.score(best.shown.render, blurred(carriers.whole, s.blur));
  s.score = std::move(score.score);
  s.precision = std::move(score.precision);
  return s;
}

}  // namespace

ResidualSigns residual_signs(nerf::Renderer& renderer, const Owner& owner, const EvidenceView& image) {
  const CachedView render = cache_view(renderer, owner.field, image.camera, kSamples);
  Carriers mark = carriers(owner, render);
  MarkScore score = score_of(image, render, owner.field, mark);
  SignFit fit = fit_signs(mark, score, owner.cells.count());
  if (!image.jpeg && fit.explained < kMostlyNoise) {
    turn_colours(score, mark);
    fit = fit_signs(mark, score, owner.cells.count());
  }
  return {.sign = std::move(fit.sign),
          .lost_detail = image.jpeg || image.zoom * score.blur >= kStrongBlur || image.small};
}

}  // namespace fieldmark::watermark
