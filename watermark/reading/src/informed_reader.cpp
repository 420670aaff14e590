#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/mirror.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/watermark/reading/informed_reader.h>
#include "best_alignment.h"
#include "camera_search.h"
#include "joint_evidence.h"
#include "jpeg_score.h"
#include "plain_border.h"
#include "pose_alignment.h"
#include "sign_fit.h"
#include "surround.h"
#include "tone_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "blurred.h"
#include "ordered_sum.h"

namespace fieldmark::watermark {
namespace {

constexpr Index kByPlaces = 3, kByImage = 3, kByPart = 6;  // candidate cameras
constexpr AlignmentStage kCoarse[] = {{.size = 48, .blur = 1.5, .steps = 6, .quick = true}};
constexpr double kSure = 0.95;   // agreement: a symmetric object agrees with its mirror image, but less
constexpr Index kFewViews = 64;  // tried first: they suffice for most images, at a seventh of the time
constexpr double kStretches[] = {1.5, 1 / 1.5, 1.25, 0.8};  // of the width
constexpr AlignmentStage kCoarseStretched[] = {
    {.size = 64, .blur = 1.5, .steps = 10, .stretched = true, .quick = true}};
constexpr AlignmentStage kFineStretched[] = {
    {.size = 96, .blur = 1.2, .steps = 10, .stretched = true, .quick = true},
    {.size = 200, .blur = 1.2, .steps = 6, .stretched = true}};
constexpr AlignmentStage kFine[] = {{.size = 96, .blur = 1.2, .steps = 10, .quick = true},
                                    {.size = 200, .blur = 1.2, .steps = 6}};
constexpr Index kBesideCover = 2;      // pixels beside a bar that are ignored
constexpr Index kSamples = 4;          // per ray
constexpr Index kLargest = 512;        // longer side at which evidence is taken, pixels
constexpr double kFarFromLeast = 1.2;  // of the least residual: beyond, the search for a blur ends
constexpr double kBlurs[] = {0, 0.4, 0.6, 0.8, 1, 1.25, 1.5, 2, 2.5, 3};  // standard deviations tried, pixels
constexpr int kTonePasses = 2;
constexpr double kAround = 4;           // standard deviation of the window for the local power, pixels
constexpr float kLeastNoise = 1.2e-6f;  // variance of rounding to 8 bits
// An image has lost detail if it is blurred by so many pixels, or smaller than this share of the training
// images.
constexpr double kStrongBlur = 1, kSmallShare = 0.6;

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
  RobustTones fit = fit_tones_robustly(blurred(base, best.blur), image, object, kTonePasses);
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

// Returns four points of a scene that do not lie in a plane, to tell cameras apart.
std::vector<nerf::Vec3> landmarks_of(const nerf::CameraSpan& span) {
  std::vector<nerf::Vec3> points(4, span.centre);
  for (std::size_t a = 0; a < 3; ++a) points[a][a] += 0.5 * span.half_size;
  return points;
}

// Undoes a horizontal stretch by a factor.
Tensor<float> narrowed(const Tensor<float>& image, double factor) {
  if (factor == 1) return image;
  const double width = static_cast<double>(image.shape[1]) / factor;
  return resize_area(image, image.shape[0], std::max<Index>(1, std::lround(width)));
}

}  // namespace

const char* reading_name(ReadingKind kind) { return kind == ReadingKind::informed ? "informed" : "blind"; }

// Changes of a view to undo before reading.
struct InformedReader::Change {
  bool mirrored = false;
  double stretch = 1;  // factor on the width
};

struct InformedReader::Parts {
  CameraSearchOptions options;
  CameraSearch few;
  std::optional<CameraSearch> all;  // made for the first image that needs it
  PoseAligner aligner;
  nerf::Renderer renderer;
  Parts(const Owner& owner, const CameraSearchOptions& o)
      : options(o), few(owner, few_of(o)), aligner(owner.field), renderer(owner.field) {}
  static CameraSearchOptions few_of(CameraSearchOptions o) {
    o.views = std::min(o.views, kFewViews);
    o.around = std::min<Index>(o.around, 0);  // negative values are kept and refused later
    return o;
  }
};

InformedReader::InformedReader(const Owner& owner, const CameraSearchOptions& search)
    : owner_(owner), blind_(owner), parts_(std::make_unique<Parts>(owner, search)) {}

const CameraSearch& InformedReader::all_views() {
  if (!parts_->all) parts_->all.emplace(owner_, parts_->options);
  return *parts_->all;
}
InformedReader::~InformedReader() = default;

std::vector<double> InformedReader::evidence_at(const Tensor<float>& image, const nerf::Camera& camera) {
  check_rank("informed_reader", "image", image.shape, 3, "[H, W, 3]");
  if (image.shape != Shape{camera.height, camera.width, 3})
    throw ShapeError("[informed_reader] image must be of the camera's size, [" +
                     std::to_string(camera.height) + ", " + std::to_string(camera.width) +
                     ", 3], got shape " + image.shape.str());
  check_finite("informed_reader", image);
  return residual_at({.image = image, .plain = {}}, camera).sign;
}

InformedReader::Residual InformedReader::residual_at(const Surround& seen, const nerf::Camera& camera) {
  const CachedView view = cache_view(parts_->renderer, owner_.field, camera, kSamples);
  Carriers mark = carriers(owner_, view);
  const bool replaced = seen.plain.size() > 0;
  const Tensor<float> image = replaced ? before_background(seen.plain, view.opacity, seen.colour,
                                                           nerf::background_value(owner_.field.background))
                                       : seen.image;
  // The coefficients of a JPEG image belong to its own background.
  const auto jpeg = replaced ? std::nullopt : find_jpeg(image);
  const auto border = seen.covered.empty() ? border_of(owner_.field, image) : seen.covered;
  const MarkScore score = score_of(image, view, mark, border, jpeg);
  const nerf::CameraSpan& trained = owner_.field.cameras;
  const auto longer = [](const auto& size) { return static_cast<double>(std::max(size.width, size.height)); };
  const bool small = longer(camera) < kSmallShare * longer(trained);
  return {.sign = fit_signs(mark, score, owner_.cells.count()).sign,
          .lost_detail = jpeg || score.blur >= kStrongBlur || small};
}

// Returns cameras whose renders look like the image, in the frame of the changed image.
std::vector<nerf::Camera> InformedReader::lookalikes(const CameraSearch& search, const Tensor<float>& image,
                                                     const Change& change) {
  std::vector<nerf::Camera> cameras = search.find(narrowed(image, change.stretch), kByImage);
  if (change.stretch == 1) return cameras;
  const Index w = image.shape[1];
  for (nerf::Camera& camera : cameras) {
    const double back = static_cast<double>(w) / static_cast<double>(camera.width);
    camera.fx *= back;
    camera.cx *= back;
    camera.width = w;
  }
  return cameras;
}

// Aligns coarsely from several cameras, until an agreement is `enough`, and adds the results to `found`.
// Returns true if one reached it.
bool InformedReader::try_all(const Surround& seen, const Change& change,
                             const std::vector<nerf::Camera>& cameras, std::vector<Alignment>& found,
                             double enough) {
  const std::span<const AlignmentStage> stages = change.stretch == 1 ? kCoarse : kCoarseStretched;
  for (const nerf::Camera& start : cameras) {
    found.push_back(parts_->aligner.align(seen.image, start, stages, seen.covered));
    if (found.back().agreement >= enough) return true;
  }
  return false;
}

// Aligns coarsely from cameras that show the recognised cells. If none reaches `enough`, aligns from cameras
// whose renders look like the image, too; finding these takes longer.
void InformedReader::try_search(const CameraSearch& search, const Surround& seen, const Change& change,
                                const SeenPlaces& places, std::vector<Alignment>& found, double enough) {
  const Index h = seen.image.shape[0], w = seen.image.shape[1];
  if (change.stretch == 1 && try_all(seen, change, search.find(places, h, w, kByPlaces), found, enough))
    return;
  try_all(seen, change, lookalikes(search, seen.image, change), found, enough);
}

InformedReading InformedReader::refined(const Surround& seen, const Change& change,
                                        const std::vector<Alignment>& found) {
  const std::span<const AlignmentStage> stages = change.stretch == 1 ? kFine : kFineStretched;
  const Alignment best =
      best_alignment(found, kSure, landmarks_of(owner_.field.cameras), [&](const nerf::Camera& camera) {
        return parts_->aligner.align(seen.image, camera, stages, seen.covered);
      });
  return {.evidence = {}, .camera = best.camera, .agreement = best.agreement};
}

// Returns the best alignment of an image without its surround, coarse, then fine.
InformedReading InformedReader::aligned(const Surround& seen, const Change& change,
                                        const SeenPlaces& places) {
  const Tensor<float>& image = seen.image;
  const bool stretched = change.stretch != 1;
  InformedReading quick;
  if (!stretched && !change.mirrored) {
    std::vector<Alignment> few;
    try_search(parts_->few, seen, change, places, few, kSure);
    quick = refined(seen, change, few);
    if (quick.agreement >= kSure) return quick;
  }
  const CameraSearch& search = all_views();
  std::vector<Alignment> found;
  const auto doubtful = [&] {
    return std::ranges::all_of(found, [](const auto& a) { return a.agreement < kLeastAgreement; });
  };
  try_search(search, seen, change, places, found);
  if (doubtful()) try_all(seen, change, search.find_by_lightness(image, kByImage), found);
  if (!stretched && doubtful()) try_all(seen, change, search.find_part(image, kByPart), found);
  const InformedReading best = refined(seen, change, found);
  return quick.agreement > best.agreement ? quick : best;
}

ImageReading InformedReader::read_as(const Tensor<float>& whole, const Change& change) {
  ImageReading reading;
  reading.mirrored = change.mirrored;
  SeenPlaces places;
  const Surround seen = cleared(whole);
  reading.blind = blind_.evidence(seen.image, &places);
  InformedReading& g = reading.informed;
  g = aligned(seen, change, places);
  if (g.agreement < 0) return reading;
  const Index h = seen.image.shape[0], w = seen.image.shape[1];
  const nerf::Camera used = g.camera.scaled(std::min(kLargest, std::max(h, w)));
  const auto at_size = [&](const Tensor<float>& x) {
    return x.size() > 0 ? resize_area(x, used.height, used.width) : x;
  };
  Surround sized{.image = at_size(seen.image), .plain = at_size(seen.plain), .colour = seen.colour};
  if (!seen.covered.empty())
    sized.covered = border_at(seen.covered, h, w, used.height, used.width, kBesideCover);
  const Residual residual = residual_at(sized, used);
  g.evidence = residual.lost_detail ? joint_evidence(reading.blind, residual.sign)
                                    : scaled_to(reading.blind, residual.sign);
  if (g.agreement >= kLeastAgreement) reading.chosen = ReadingKind::informed;
  // Converts the camera to the whole image.
  g.camera.cx += static_cast<double>(seen.left);
  g.camera.cy += static_cast<double>(seen.top);
  g.camera.width = whole.shape[1];
  g.camera.height = whole.shape[0];
  return reading;
}

Surround InformedReader::cleared(const Tensor<float>& whole) const {
  return clear_surround(whole, nerf::background_value(owner_.field.background),
                        owner_.field.space.kind == nerf::SpaceKind::cube);
}

ImageReading InformedReader::read(const Tensor<float>& image) {
  const Tensor<float> whole = opaque_image(image, nerf::background_value(owner_.field.background));
  ImageReading best = read_as(whole, {});
  if (best.informed.agreement >= kSure) return best;
  for (const Change& change : changes(cleared(whole).image)) {
    ImageReading changed = read_as(change.mirrored ? mirrored(whole) : whole, change);
    if (changed.chosen == ReadingKind::informed && changed.informed.agreement > best.informed.agreement)
      best = std::move(changed);
  }
  return best;
}

// Returns changes to try: a mirror, and the stretch that makes the image look most like the field, if any
// makes it look more like it than no stretch.
std::vector<InformedReader::Change> InformedReader::changes(const Tensor<float>& seen) {
  std::vector<Change> changes{{.mirrored = true}};
  const CameraSearch& search = all_views();
  double most = search.likeness(seen), stretch = 1;
  for (const double tried : kStretches) {
    const double likeness = search.likeness(narrowed(seen, tried));
    if (likeness <= most) continue;
    most = likeness;
    stretch = tried;
  }
  if (stretch != 1) changes.push_back({.stretch = stretch});
  return changes;
}

}  // namespace fieldmark::watermark
