#include "evidence_view.h"
#include <fieldmark/imaging/resize.h>
#include "jpeg_trace.h"
#include "plain_border.h"

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr Index kLargest = 512;        // longer side, pixels
constexpr double kMostShown = 48'000;  // pixels that show the field
constexpr double kSmallShare = 0.6;    // of the training images' scale
constexpr Index kBesideCover = 2;      // pixels beside a bar that are ignored

// By focal length, since a crop has fewer pixels and as much detail.
bool is_small(const nerf::Camera& camera, const nerf::CameraSpan& trained) {
  return camera.fx < kSmallShare * trained.fx * static_cast<double>(trained.width);
}

// Returns the longer side at which at most kMostShown pixels show the field.
Index enough(const nerf::Camera& camera, double shown) {
  const auto longer = static_cast<double>(std::max(camera.width, camera.height));
  const double pixels = shown * static_cast<double>(camera.width * camera.height);
  return std::lround(pixels > kMostShown ? longer * std::sqrt(kMostShown / pixels) : longer);
}

}  // namespace

EvidenceView evidence_view(const Surround& seen, const nerf::Camera& camera, double shown,
                           const nerf::CameraSpan& trained) {
  const Index h = seen.image.shape[0], w = seen.image.shape[1];
  const nerf::Camera largest = camera.scaled(std::min(kLargest, std::max(h, w)));
  EvidenceView view{.seen = {}, .camera = largest, .small = is_small(largest, trained)};
  // The coefficients of a JPEG image belong to its own background and size.
  if (largest.width == w && largest.height == h) view.jpeg = find_jpeg(own_image(seen), seen.left, seen.top);
  if (!view.jpeg) view.camera = camera.scaled(enough(largest, shown));
  view.zoom = static_cast<double>(largest.width) / static_cast<double>(view.camera.width);
  const auto at_size = [&](const Tensor<float>& x) {
    return x.size() > 0 ? resize_area(x, view.camera.height, view.camera.width) : x;
  };
  view.seen = {.image = at_size(seen.image), .plain = at_size(seen.plain), .colour = seen.colour};
  if (!seen.covered.empty())
    view.seen.covered = border_at(seen.covered, h, w, view.camera.height, view.camera.width, kBesideCover);
  return view;
}

}  // namespace fieldmark::watermark
