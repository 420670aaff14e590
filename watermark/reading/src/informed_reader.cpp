#include <fieldmark/imaging/resize.h>
#include <fieldmark/watermark/reading/informed_reader.h>
#include "camera_search.h"
#include "jpeg_score.h"
#include "plain_border.h"
#include "pose_alignment.h"
#include "sign_fit.h"
#include "tone_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "blurred.h"

namespace fieldmark::watermark {
namespace {

constexpr Index kByPlaces = 3, kByImage = 3, kByPart = 6;  // candidate cameras
constexpr AlignmentStage kCoarse[] = {{.size = 48, .blur = 1.5, .steps = 6, .quick = true}};
constexpr AlignmentStage kFine[] = {{.size = 96, .blur = 1.2, .steps = 10, .quick = true},
                                    {.size = 200, .blur = 1.2, .steps = 6}};
constexpr Index kSamples = 4;          // of a ray
constexpr Index kLargest = 512;        // longer side at which evidence is taken, pixels
constexpr double kFarFromLeast = 1.2;  // of the least residual: the search for a blur ends beyond
constexpr double kBlurs[] = {0, 0.4, 0.6, 0.8, 1, 1.25, 1.5, 2, 2.5, 3};  // standard deviations tried, pixels
constexpr double kAround = 4;           // standard deviation of the window for the local power, pixels
constexpr float kLeastNoise = 1.2e-6f;  // variance of rounding to 8 bits

// The unmarked render in the image's blur and tones, and the residual.
struct Shown {
  Tensor<float> render, rest;
  double blur = 0, left = 0;
};

Shown shown_with(const Tensor<float>& image, const Tensor<float>& base, const std::vector<double>& object,
                 double blur) {
  Shown s{.render = blurred(base, blur), .rest = Tensor<float>(image.shape), .blur = blur};
  const ToneFit tones = fit_tones(s.render, image, object);
  for (Index i = 0; i < s.rest.size(); ++i) {
    s.render[i] = static_cast<float>(tones.at(i % 3, static_cast<double>(s.render[i])));
    s.rest[i] = image[i] - s.render[i];
    s.left += object[at(i / 3)] * static_cast<double>(s.rest[i] * s.rest[i]);
  }
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
  return best;
}

// The noise is the local power of the residual, mark included.
void score_differences(const Tensor<float>& rest, MarkScore& s) {
  Tensor<float> power = rest;
  for (float& x : power.data) x *= x;
  power = blurred(power, kAround);
  for (Index i = 0; i < power.size(); ++i) {
    s.precision[i] = 1 / (std::max(power[i], 0.f) + kLeastNoise);
    s.score[i] = rest[i] * s.precision[i];
  }
}

// JpegScore's information is of a whole block, so all channels of a pixel get the same precision.
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

MarkScore score_of(const Tensor<float>& image, const CachedView& view, const Tensor<float>& mark,
                   const std::vector<std::uint8_t>& border, const std::optional<JpegTrace>& jpeg) {
  MarkScore s{.score = Tensor<float>(image.shape), .precision = Tensor<float>(image.shape), .on_object = {}};
  for (const float opacity : view.opacity.data) s.on_object.push_back(opacity > 0.5f ? 1 : 0);
  for (std::size_t p = 0; p < border.size(); ++p)
    if (border[p]) s.on_object[p] = 0;
  const Shown seen = shown(image, view.base, s.on_object);
  s.blur = seen.blur;
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

const char* reading_name(ReadingKind kind) { return kind == ReadingKind::informed ? "informed" : "blind"; }

struct InformedReader::Parts {
  CameraSearch search;
  PoseAligner aligner;
  nerf::Renderer renderer;
  Parts(const Owner& owner, const CameraSearchOptions& options)
      : search(owner, options), aligner(owner.field), renderer(owner.field) {}
};

InformedReader::InformedReader(const Owner& owner, const CameraSearchOptions& search)
    : owner_(owner), blind_(owner), parts_(std::make_unique<Parts>(owner, search)) {}
InformedReader::~InformedReader() = default;

std::vector<double> InformedReader::evidence_at(const Tensor<float>& image, const nerf::Camera& camera) {
  const CachedView view = cache_view(parts_->renderer, owner_.field, camera, kSamples);
  const Carriers mark = carriers(owner_, view);
  const MarkScore score = score_of(image, view, mark.whole, border_of(owner_.field, image), find_jpeg(image));
  return fit_signs(mark, score, owner_.cells.count()).sign;
}

ImageReading InformedReader::read(const Tensor<float>& image) {
  ImageReading reading;
  SeenPlaces places;
  reading.blind = blind_.evidence(image, &places);
  const Tensor<float> whole = opaque_image(image, nerf::background_value(owner_.field.background));
  const Index h = whole.shape[0], w = whole.shape[1];
  InformedReading& g = reading.informed;
  std::vector<nerf::Camera> starts = parts_->search.find(places, h, w, kByPlaces);
  const std::vector<nerf::Camera> others = parts_->search.find(whole, kByImage);
  starts.insert(starts.end(), others.begin(), others.end());
  const auto try_all = [&](const std::vector<nerf::Camera>& cameras) {
    for (const nerf::Camera& start : cameras) {
      const Alignment a = parts_->aligner.align(whole, start, kCoarse);
      if (a.agreement > g.agreement) {
        g.agreement = a.agreement;
        g.camera = a.camera;
      }
    }
  };
  try_all(starts);
  if (g.agreement < kLeastAgreement) try_all(parts_->search.find_part(whole, kByPart));
  if (g.agreement < 0) return reading;
  const Alignment a = parts_->aligner.align(whole, g.camera, kFine);
  g.camera = a.camera;
  g.agreement = a.agreement;
  const nerf::Camera used = g.camera.scaled(std::min(kLargest, std::max(h, w)));
  g.evidence = evidence_at(resize_area(whole, used.height, used.width), used);
  double ours = 0, theirs = 0;
  for (std::size_t c = 0; c < g.evidence.size(); ++c) {
    ours += g.evidence[c] * g.evidence[c];
    theirs += reading.blind[c] * reading.blind[c];
  }
  if (ours > 0 && theirs > 0)
    for (double& s : g.evidence) s *= std::sqrt(theirs / ours);
  if (g.agreement >= kLeastAgreement) reading.chosen = ReadingKind::informed;
  return reading;
}

}  // namespace fieldmark::watermark
