#include <fieldmark/imaging/resize.h>
#include <fieldmark/watermark/scanning/page_reader.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>

namespace fieldmark::watermark {
namespace {

constexpr double kMostOfImage = 0.95;    // share of its pixels; a larger block is the image
constexpr Index kMostElongated = 8;      // longer to shorter side of a block: no view is longer
constexpr Index kMarginShare = 10;       // of a part's shorter side: renders of objects have a margin
constexpr Index kLargest = 512;          // longer side of an image that is searched for an object, pixels
constexpr Index kLeastReduced = 16;      // shorter side of the same image, and of a part of it
constexpr Index kCandidates = 2;         // places of the whole object that are tried, and of its quarters
constexpr double kBesideOutline = 0.03;  // of a part's longer side: error of a candidate's outline
constexpr int kRefinements = 4;
constexpr Index kCoarse = 32;  // longer side at which a candidate is compared with the image, pixels
// Agreement inside the outline of a candidate: in images of something else -0.3 to 0.15, of a quarter to 0.3,
// few above 0.28.
constexpr double kLeastCoarse = 0.1, kLeastCoarseQuarter = 0.28;
constexpr Index kCompared = 160;  // longer side at which a render is compared with the image, pixels
constexpr float kSolid = 0.9f;    // opacity inside the outline
// Agreement inside the outline. Candidates in images of something else stay below 0.05, cameras a little off
// the right one have 0.1 to 0.7.
constexpr double kPromising = 0.08;   // from here a camera is refined
constexpr double kLeastGain = 0.005;  // of a refinement that is followed by another
constexpr double kLeastInside = 0.3;  // at which an object counts as found
constexpr double kSureInside = 0.9;   // at which no other place is tried

using Colour = std::array<float, 3>;

// Cuts a box out, which may reach beyond the image, with background outside.
Tensor<float> cut(const Tensor<float>& image, const PixelBox& box, Index margin, const Colour& background) {
  const Index h = box.height + 2 * margin, w = box.width + 2 * margin;
  Tensor<float> out({h, w, 3});
  for (Index p = 0; p < h * w; ++p) std::ranges::copy(background, &out[3 * p]);
  const Index left = std::max<Index>(0, -box.x), right = std::min(box.width, image.shape[1] - box.x);
  for (Index y = std::max<Index>(0, -box.y); y < std::min(box.height, image.shape[0] - box.y); ++y)
    if (right > left)
      std::copy_n(&image[3 * ((box.y + y) * image.shape[1] + box.x + left)], 3 * (right - left),
                  &out[3 * ((y + margin) * w + margin + left)]);
  return out;
}

// Returns the largest opacity within `radius` pixels along rows and columns.
Tensor<float> widened(const Tensor<float>& opacity, Index radius) {
  const Index h = opacity.shape[0], w = opacity.shape[1];
  Tensor<float> rows(opacity.shape), out(opacity.shape);
  for (Index y = 0; y < h; ++y)
    for (Index x = 0; x < w; ++x) {
      const Index first = std::max<Index>(0, x - radius), last = std::min(w - 1, x + radius);
      rows[y * w + x] = *std::max_element(&opacity[y * w + first], &opacity[y * w + last] + 1);
    }
  for (Index y = 0; y < h; ++y)
    for (Index x = 0; x < w; ++x) {
      float most = 0;
      for (Index v = std::max<Index>(0, y - radius); v <= std::min(h - 1, y + radius); ++v)
        most = std::max(most, rows[v * w + x]);
      out[y * w + x] = most;
    }
  return out;
}

// Returns a camera of the box, for one of the whole image.
nerf::Camera camera_of(const nerf::Camera& camera, const PixelBox& box) {
  nerf::Camera part = camera;
  part.cx -= static_cast<double>(box.x);
  part.cy -= static_cast<double>(box.y);
  part.width = box.width;
  part.height = box.height;
  return part;
}

// Returns the correlation of the colours' differences between neighbours in an image and in a render, inside
// the outline alone: the outline itself was cut out and agrees with any render.
double agreement_inside(const Tensor<float>& image, const nerf::Rendering& view) {
  const Index h = image.shape[0], w = image.shape[1];
  double both = 0, first = 0, second = 0;
  const auto inside = [&](Index y, Index x) {
    for (Index v = std::max<Index>(0, y - 2); v <= std::min(h - 1, y + 2); ++v)
      for (Index u = std::max<Index>(0, x - 2); u <= std::min(w - 1, x + 2); ++u)
        if (!(view.opacity[v * w + u] >= kSolid)) return false;
    return true;
  };
  for (Index y = 0; y + 1 < h; ++y)
    for (Index x = 0; x + 1 < w; ++x) {
      if (!inside(y, x)) continue;
      for (const Index next : {y * w + x + 1, (y + 1) * w + x})
        for (Index c = 0; c < 3; ++c) {
          const auto a = static_cast<double>(image[3 * next + c] - image[3 * (y * w + x) + c]);
          const auto b = static_cast<double>(view.rgb[3 * next + c] - view.rgb[3 * (y * w + x) + c]);
          both += a * b, first += a * a, second += b * b;
        }
    }
  return first > 0 && second > 0 ? both / std::sqrt(first * second) : 0;
}

PixelBox box_of(const ObjectPlace& place) {
  const auto shorter = std::min(place.window.width, place.window.height);
  const double margin = place.whole ? shorter / static_cast<double>(kMarginShare) : 0;
  return {std::lround(place.window.x - margin), std::lround(place.window.y - margin),
          std::max(kLeastReduced, std::lround(place.window.width + 2 * margin)),
          std::max(kLeastReduced, std::lround(place.window.height + 2 * margin))};
}

struct Candidate {
  PixelBox box;
  Tensor<float> image;  // of the box
  nerf::Camera camera;  // of the box
  double inside;        // agreement inside the outline
};

}  // namespace

std::vector<double> PageReading::evidence() const {
  if (parts.empty()) return whole.evidence();
  std::vector<double> sum(whole.blind.size(), 0.0);
  for (const PartReading& part : parts) {
    const std::vector<double>& evidence = part.reading.evidence();
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += evidence[c];
  }
  return sum;
}

double PageReading::agreement() const {
  double most = whole.informed.agreement;
  for (const PartReading& part : parts) most = std::max(most, part.reading.informed.agreement);
  return most;
}

PageReader::PageReader(const Owner& owner, const CameraSearchOptions& search)
    : owner_(owner), reader_(owner, search) {}

PageReading PageReader::read(const Tensor<float>& image) {
  PageReading page{.whole = reader_.read(image)};
  if (page.whole.chosen == ReadingKind::informed) return page;
  const Tensor<float> rgb = opaque_image(image, nerf::background_value(owner_.field.background));
  page.parts = read_blocks(rgb);
  if (page.parts.empty() && owner_.field.space.kind == nerf::SpaceKind::cube) page.parts = read_object(rgb);
  return page;
}

std::vector<PartReading> PageReader::read_blocks(const Tensor<float>& rgb) {
  const bool object = owner_.field.space.kind == nerf::SpaceKind::cube;
  const ImageBlocks found = image_blocks(rgb, kLeastSide);
  const auto smaller = [](const ImageBlock* a, const ImageBlock* b) { return a->box.area() < b->box.area(); };
  std::priority_queue<const ImageBlock*, std::vector<const ImageBlock*>, decltype(smaller)> blocks(smaller);
  blocks.push(&found.all);
  const auto all = static_cast<double>(rgb.shape[0] * rgb.shape[1]);
  std::vector<PartReading> parts;
  for (Index read = 0; read < kMostBlocks && !blocks.empty();) {
    const ImageBlock& block = *blocks.top();
    blocks.pop();
    const PixelBox& box = block.box;
    const Index shorter = std::min(box.width, box.height), longer = std::max(box.width, box.height);
    if (shorter >= kLeastSide && longer <= kMostElongated * shorter &&
        static_cast<double>(box.area()) <= kMostOfImage * all) {
      ++read;
      const Index margin = object ? shorter / kMarginShare : 0;
      PartReading part{box, reader_.read(cut(rgb, box, margin, found.background))};
      if (part.reading.chosen == ReadingKind::informed) {
        parts.push_back(std::move(part));
        continue;
      }
    }
    for (const ImageBlock& inner : block.parts) blocks.push(&inner);
  }
  return parts;
}

// Reads a box of the image in which everything outside the object's outline is the field's background.
PageReader::Cleared PageReader::read_cleared(const Tensor<float>& box, const nerf::Camera& camera,
                                             Index beside) {
  const float level = nerf::background_value(owner_.field.background);
  const Tensor<float> inside = widened(renderer_->render(camera).opacity, beside);
  Tensor<float> cleared = box;
  for (Index i = 0; i < cleared.size(); ++i) cleared[i] = level + inside[i / 3] * (cleared[i] - level);
  Cleared found{reader_.read(cleared), 0};
  if (found.reading.informed.agreement < 0 || found.reading.mirrored) return found;
  const Index longer = std::max(box.shape[0], box.shape[1]);
  const nerf::Camera compared = found.reading.informed.camera.scaled(std::min(kCompared, longer));
  found.inside =
      agreement_inside(resize_area(box, compared.height, compared.width), renderer_->render(compared));
  return found;
}

// The outline of a candidate is not exact, so its camera is not either; the outline from there is better.
PageReader::Cleared PageReader::read_at(const Tensor<float>& box, const nerf::Camera& candidate) {
  const auto longer = static_cast<double>(std::max(box.shape[0], box.shape[1]));
  Cleared best = read_cleared(box, candidate, std::lround(kBesideOutline * longer));
  for (int k = 0; k < kRefinements && best.inside >= kPromising; ++k) {
    Cleared refined = read_cleared(box, best.reading.informed.camera, 1);
    if (refined.inside <= best.inside + kLeastGain) break;
    best = std::move(refined);
  }
  return best;
}

std::vector<PartReading> PageReader::read_object(const Tensor<float>& whole) {
  if (!renderer_) renderer_ = std::make_unique<nerf::Renderer>(owner_.field);
  if (!objects_) objects_.emplace(owner_);
  const Index h = whole.shape[0], w = whole.shape[1];
  const double zoom = std::min(1., static_cast<double>(kLargest) / static_cast<double>(std::max(h, w)));
  const auto side = [&](Index length) { return std::lround(zoom * static_cast<double>(length)); };
  if (std::min(side(h), side(w)) < kLeastReduced) return {};
  const auto back = [&](Index length) { return std::lround(static_cast<double>(length) / zoom); };
  const Tensor<float> rgb = zoom < 1 ? resize_area(whole, side(h), side(w)) : whole;
  const float level = nerf::background_value(owner_.field.background);
  std::vector<Candidate> candidates;
  for (const ObjectPlace& place : objects_->find(rgb, kCandidates)) {
    const PixelBox box = box_of(place);
    if (std::max(box.width, box.height) < kLeastSide) continue;
    Candidate next{box, cut(rgb, box, 0, {level, level, level}), camera_of(place.camera, box), 0};
    const nerf::Camera coarse = next.camera.scaled(kCoarse);
    next.inside =
        agreement_inside(resize_area(next.image, coarse.height, coarse.width), renderer_->render(coarse));
    if (next.inside >= (place.whole ? kLeastCoarse : kLeastCoarseQuarter))
      candidates.push_back(std::move(next));
  }
  std::ranges::stable_sort(candidates, std::ranges::greater(), &Candidate::inside);
  std::vector<PartReading> best;
  double most = kLeastInside;
  for (const auto& [box, seen, camera, coarse] : candidates) {
    Cleared found = read_at(seen, camera);
    if (found.inside < most) continue;
    most = found.inside;
    found.reading.chosen = ReadingKind::informed;
    best = {{{back(box.x), back(box.y), back(box.width), back(box.height)}, std::move(found.reading)}};
    if (most >= kSureInside) break;
  }
  return best;
}

}  // namespace fieldmark::watermark
