#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/mirror.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/watermark/reading/informed_reader.h>
#include <fieldmark/watermark/reading/joint_evidence.h>
#include "best_alignment.h"
#include "camera_search.h"
#include "evidence_view.h"
#include "mirror_choice.h"
#include "plain_border.h"
#include "pose_alignment.h"
#include "residual_signs.h"
#include "surround.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace fieldmark::watermark {
namespace {

constexpr Index kByPlaces = 3, kByImage = 3, kByPart = 6;  // candidate cameras
constexpr AlignmentStage kCoarse[] = {{.size = 48, .blur = 1.5, .steps = 6, .quick = true}};
constexpr Index kFewViews = 64;  // tried first: they suffice for most images, at a seventh of the time
constexpr double kStretches[] = {1.5, 1 / 1.5, 1.25, 0.8};  // of the width
constexpr AlignmentStage kCoarseStretched[] = {
    {.size = 64, .blur = 1.5, .steps = 10, .stretched = true, .quick = true}};
constexpr double kFarOff = 0.5;  // agreement at 96 pixels, far below 0.85: not aligned at 200
constexpr AlignmentStage kFineStretched[] = {
    {.size = 96, .blur = 1.2, .steps = 10, .stretched = true, .quick = true, .least = kFarOff},
    {.size = 200, .blur = 1.2, .steps = 6, .stretched = true}};
constexpr AlignmentStage kFine[] = {{.size = 96, .blur = 1.2, .steps = 10, .quick = true, .least = kFarOff},
                                    {.size = 200, .blur = 1.2, .steps = 6}};
constexpr AlignmentStage kFinest[] = {{.size = 400, .blur = 1, .steps = 20, .still = 0.02}};
constexpr Index kPartSize = 200;  // longer side at which a part is aligned, pixels
// Agreement of a part: at the right camera 0.90 to 0.99 at 48 pixels and 0.92 to 0.99 at 96, in images of
// something else below 0.85 and 0.59 in 95 of 100 places.
constexpr double kLeastOfPart = 0.8;
constexpr AlignmentStage kPartCoarse[] = {
    {.size = 48, .blur = 1.5, .steps = 6, .quick = true, .least = kLeastOfPart},
    {.size = 96, .blur = 1.2, .steps = 10, .quick = true}};
constexpr AlignmentStage kPartFine[] = {
    {.size = 96, .blur = 1.2, .steps = 10, .quick = true, .least = kLeastOfPart},
    {.size = 200, .blur = 1.2, .steps = 6}};
// As the last of kPartFine, but to the end: steps shorten long before.
constexpr AlignmentStage kPartFinest[] = {{.size = kPartSize, .blur = 1, .steps = 20, .still = 0.02}};
// Of the extractor, see joint_evidence(): without JPEG, it reads most of what blur and reduction took.
constexpr double kTrust = 2;
constexpr Index kLeastPartSide = 16;  // of a part, pixels
constexpr float kInsidePart = 0.9f;   // opacity inside the outline of a part

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

void check_size(const Tensor<float>& image, const nerf::Camera& camera) {
  check_rank("informed_reader", "image", image.shape, 3, "[H, W, 3]");
  if (image.shape != Shape{camera.height, camera.width, 3})
    throw ShapeError("[informed_reader] image must be of the camera's size, [" +
                     std::to_string(camera.height) + ", " + std::to_string(camera.width) +
                     ", 3], got shape " + image.shape.str());
  check_finite("informed_reader", image);
}

void check_part(const Tensor<float>& image, const nerf::Camera& camera,
                const std::vector<std::uint8_t>& covered) {
  check_size(image, camera);
  if (std::min(camera.width, camera.height) < kLeastPartSide)
    throw ShapeError("[informed_reader] image must have sides of at least 16, got shape " +
                     image.shape.str());
  if (!covered.empty() && std::ssize(covered) != camera.width * camera.height)
    throw ShapeError("[informed_reader] covered must have the image's " +
                     std::to_string(camera.width * camera.height) + " pixels, got " +
                     std::to_string(covered.size()));
}

// Adds to the pixels covered in a view those covered in the whole image, of another size.
std::vector<std::uint8_t> without(const std::vector<std::uint8_t>& covered, const nerf::Camera& whole,
                                  std::vector<std::uint8_t> outside, const nerf::Camera& view) {
  if (covered.empty()) return outside;
  const auto sized = border_at(covered, whole.height, whole.width, view.height, view.width, 0);
  for (std::size_t p = 0; p < outside.size(); ++p)
    if (sized[p]) outside[p] = 1;
  return outside;
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
  check_size(image, camera);
  const EvidenceView view = evidence_view({.image = image, .plain = {}}, camera, 0, owner_.field.cameras);
  return residual_signs(parts_->renderer, owner_, view).sign;
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

Alignment InformedReader::refined(const Surround& seen, const Change& change,
                                  const std::vector<Alignment>& found) {
  const std::span<const AlignmentStage> stages = change.stretch == 1 ? kFine : kFineStretched;
  return best_alignment(found, kSure, landmarks_of(owner_.field.cameras), [&](const nerf::Camera& camera) {
    return parts_->aligner.align(seen.image, camera, stages, seen.covered);
  });
}

// Returns the best alignment of an image without its surround, coarse, then fine.
Alignment InformedReader::aligned(const Surround& seen, const Change& change, const SeenPlaces& places) {
  const Tensor<float>& image = seen.image;
  const bool stretched = change.stretch != 1;
  Alignment quick{.camera = {}};
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
  const Alignment best = refined(seen, change, found);
  return quick.agreement > best.agreement ? quick : best;
}

ImageReading InformedReader::read_as(const Tensor<float>& whole, const Change& change, double least) {
  ImageReading reading;
  reading.mirrored = change.mirrored;
  SeenPlaces places;
  const Surround seen = cleared(whole);
  reading.blind = blind_.evidence(seen.image, &places);
  InformedReading& g = reading.informed;
  const Alignment best = aligned(seen, change, places);
  g.camera = best.camera;
  g.agreement = best.agreement;
  if (g.agreement >= std::max(least, 0.0)) {
    if (is_inexact(best))
      g.camera = parts_->aligner.align(seen.image, best.camera, kFinest, seen.covered).camera;
    add_evidence(seen, best.shown, reading);
  }
  // Converts the camera to the whole image.
  g.camera.cx += static_cast<double>(seen.left);
  g.camera.cy += static_cast<double>(seen.top);
  g.camera.width = whole.shape[1];
  g.camera.height = whole.shape[0];
  return reading;
}

// Adds informed evidence from the camera found, and chooses.
void InformedReader::add_evidence(const Surround& seen, double shown, ImageReading& reading) {
  InformedReading& g = reading.informed;
  const EvidenceView view = evidence_view(seen, g.camera, shown, owner_.field.cameras);
  const ResidualSigns residual = residual_signs(parts_->renderer, owner_, view);
  const double trust = view.jpeg ? 1 : kTrust;
  g.evidence = residual.lost_detail ? joint_evidence(reading.blind, residual.sign, trust)
                                    : scaled_to(reading.blind, residual.sign);
  if (g.agreement >= kLeastAgreement) reading.chosen = ReadingKind::informed;
}

Surround InformedReader::cleared(const Tensor<float>& whole) const {
  return clear_surround(whole, nerf::background_value(owner_.field.background),
                        owner_.field.space.kind == nerf::SpaceKind::cube);
}

ImageReading InformedReader::read(const Tensor<float>& image, double least) {
  const Tensor<float> whole = opaque_image(image, nerf::background_value(owner_.field.background));
  ImageReading best = read_as(whole, {}, least);
  const double agreement = best.informed.agreement;
  if (!is_side_doubtful(agreement, owner_.field.space.kind)) return best;
  for (const Change& change : changes(cleared(whole).image, agreement < kSure)) {
    ImageReading changed = read_as(change.mirrored ? mirrored(whole) : whole, change, kLeastAgreement);
    if (changed.chosen == ReadingKind::informed && changed.informed.agreement > best.informed.agreement)
      best = std::move(changed);
  }
  return best;
}

// Marks the pixels outside the object's outline.
std::vector<std::uint8_t> InformedReader::outside(const nerf::Camera& camera) {
  const Tensor<float> opacity = parts_->renderer.render(camera).opacity;
  std::vector<std::uint8_t> covered;
  for (const float x : opacity.data) covered.push_back(x >= kInsidePart ? 0 : 1);
  return covered;
}

ImageReading InformedReader::read_near(const Tensor<float>& image, const nerf::Camera& start, double least,
                                       const std::vector<std::uint8_t>& covered) {
  check_part(image, start, covered);
  ImageReading reading;
  InformedReading& g = reading.informed;
  const nerf::Camera guess = start.scaled(std::min(kPartSize, std::max(start.width, start.height)));
  const Tensor<float> small = resize_area(image, guess.height, guess.width);
  const auto ignored = [&](const nerf::Camera& camera) {
    return without(covered, start, outside(camera), camera);
  };
  Alignment found{guess, -1};
  // The outline of the first guess is not exact.
  for (const std::span<const AlignmentStage> stages :
       {std::span(kPartCoarse), std::span(kPartFine), std::span(kPartFine)}) {
    found = parts_->aligner.align(small, found.camera, stages, ignored(found.camera));
    g.camera = found.camera.scaled(image.shape[1], image.shape[0]);
    g.agreement = found.agreement;
    if (!(g.agreement >= kLeastOfPart)) return reading;
  }
  if (!(g.agreement >= least)) return reading;
  found.camera = parts_->aligner.align(small, found.camera, kPartFinest, ignored(found.camera)).camera;
  g.camera = found.camera.scaled(image.shape[1], image.shape[0]);
  const float level = nerf::background_value(owner_.field.background);
  Surround seen{.image = image, .plain = {}, .colour = {}, .covered = ignored(g.camera)};
  const Tensor<float> opacity = parts_->renderer.render(g.camera).opacity;
  for (Index i = 0; i < image.size(); ++i) seen.image[i] = level + opacity[i / 3] * (image[i] - level);
  reading.blind = blind_.evidence(seen.image);
  add_evidence(seen, found.shown, reading);
  reading.chosen = ReadingKind::informed;
  return reading;
}

// Returns changes to try: a mirror, and on request the stretch that makes the image look most like the field,
// if any makes it look more like it than no stretch.
std::vector<InformedReader::Change> InformedReader::changes(const Tensor<float>& seen, bool stretches) {
  std::vector<Change> changes{{.mirrored = true}};
  if (!stretches) return changes;
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
