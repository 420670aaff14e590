#include <fieldmark/imaging/resize.h>
#include <fieldmark/watermark/reading/joint_evidence.h>
#include <fieldmark/watermark/scanning/page_reader.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <utility>

#include "block_choice.h"
#include "part_choice.h"

namespace fieldmark::watermark {
namespace {

constexpr double kMostOfImage = 0.95;  // share of its pixels; a larger block is the image
constexpr Index kMostElongated = 8;    // longer to shorter side of a block: no view is longer
constexpr Index kMarginShare = 10;     // of a part's shorter side: renders of objects have a margin
constexpr Index kLargest = 512;        // longer side of an image that is searched for an object, pixels
constexpr Index kLeastReduced = 16;    // shorter side of the same image, and of a part of it
// Places that are tried. With its margins, a square object of 40 pixels has PartChoice::kLeast.
constexpr ObjectSearch::Wanted kWholes{24, 40}, kQuarters{64, PartChoice::kLeast};

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

// True if no view has such sides.
bool too_long(Index width, Index height) {
  return std::max(width, height) > kMostElongated * std::min(width, height);
}

// Marks the pixels of a box that lie outside the image.
std::vector<std::uint8_t> beyond(const Tensor<float>& image, const PixelBox& box) {
  std::vector<std::uint8_t> out;
  for (Index y = box.y; y < box.y + box.height; ++y)
    for (Index x = box.x; x < box.x + box.width; ++x)
      out.push_back(y >= 0 && y < image.shape[0] && x >= 0 && x < image.shape[1] ? 0 : 1);
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

PixelBox box_of(const ObjectPlace& place) {
  const auto shorter = std::min(place.window.width, place.window.height);
  const double margin = place.whole ? shorter / static_cast<double>(kMarginShare) : 0;
  return {std::lround(place.window.x - margin), std::lround(place.window.y - margin),
          std::max(kLeastReduced, std::lround(place.window.width + 2 * margin)),
          std::max(kLeastReduced, std::lround(place.window.height + 2 * margin))};
}

}  // namespace

std::vector<double> PageReading::evidence() const {
  std::vector<double> sum = whole.evidence();
  if (chosen() == ReadingKind::blind)
    for (double& s : sum) s *= kBlindWeight;
  if (parts.empty()) return sum;
  std::ranges::fill(sum, 0.0);
  for (const PartReading& part : parts) {
    const std::vector<double> evidence = scaled_to(whole.blind, part.reading.evidence());
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += evidence[c];
  }
  return sum;
}

double PageReading::agreement() const {
  double most = whole.informed.agreement;
  for (const PartReading& part : parts) most = std::max(most, part.reading.informed.agreement);
  return most;
}

PageReader::PageReader(const Owner& owner, const CameraSearchOptions& search,
                       const ObjectSearchOptions& objects)
    : owner_(owner), reader_(owner, search), object_options_(objects) {
  ObjectSearch::check(objects);
}

PageReading PageReader::read(const Tensor<float>& image, bool informed_too) {
  PageReading page{.whole = reader_.read(image, informed_too ? -1 : InformedReader::kLeastAgreement)};
  // At the size of the alignment, a long page of words is a strip of a few grey pixels, which may agree.
  if (too_long(image.shape[1], image.shape[0])) page.whole.chosen = ReadingKind::blind;
  const bool found = page.whole.chosen == ReadingKind::informed;
  if (found && page.whole.informed.agreement >= kSureTogether) return page;
  const Tensor<float> rgb = opaque_image(image, nerf::background_value(owner_.field.background));
  const ImageBlocks blocks = image_blocks(rgb, kLeastSide);
  page.parts = read_blocks(rgb, blocks, found ? blocks.all.parts : std::vector{blocks.all});
  if (found) {
    const auto against = [&](const PartReading& part) { return contradicts(part.reading, page.whole); };
    if (std::ranges::none_of(page.parts, against)) page.parts.clear();
    return page;
  }
  if (page.parts.empty() && owner_.field.space.kind == nerf::SpaceKind::cube) page.parts = read_object(rgb);
  return page;
}

std::vector<PartReading> PageReader::read_blocks(const Tensor<float>& rgb, const ImageBlocks& found,
                                                 const std::vector<ImageBlock>& first) {
  const bool object = owner_.field.space.kind == nerf::SpaceKind::cube;
  const auto smaller = [](const ImageBlock* a, const ImageBlock* b) { return a->box.area() < b->box.area(); };
  std::priority_queue<const ImageBlock*, std::vector<const ImageBlock*>, decltype(smaller)> blocks(smaller);
  for (const ImageBlock& block : first) blocks.push(&block);
  const auto all = static_cast<double>(rgb.shape[0] * rgb.shape[1]);
  std::vector<PartReading> parts, doubtful;
  for (Index read = 0; read < kMostBlocks && !blocks.empty();) {
    const ImageBlock& block = *blocks.top();
    blocks.pop();
    const PixelBox& box = block.box;
    const Index shorter = std::min(box.width, box.height);
    if (shorter >= kLeastSide && !too_long(box.width, box.height) &&
        static_cast<double>(box.area()) <= kMostOfImage * all) {
      ++read;
      const Index margin = object ? shorter / kMarginShare : 0;
      PartReading part{
          box, reader_.read(cut(rgb, box, margin, found.background), InformedReader::kLeastAgreement)};
      if (part.reading.chosen == ReadingKind::informed) {
        const bool sure = is_sure(part.reading, block);
        (sure ? parts : doubtful).push_back(std::move(part));
        if (sure) continue;
      }
    }
    for (const ImageBlock& inner : block.parts) blocks.push(&inner);
  }
  while (!doubtful.empty()) {  // parts before the block that holds them
    take_unless_contradicted(std::move(doubtful.back()), parts);
    doubtful.pop_back();
  }
  return parts;
}

std::vector<PartReading> PageReader::read_object(const Tensor<float>& whole) {
  if (!objects_) objects_.emplace(owner_, object_options_);
  const Index h = whole.shape[0], w = whole.shape[1];
  const double zoom = std::min(1., static_cast<double>(kLargest) / static_cast<double>(std::max(h, w)));
  const auto side = [&](Index length) { return std::lround(zoom * static_cast<double>(length)); };
  if (std::min(side(h), side(w)) < kLeastReduced) return {};
  const auto back = [&](Index length) { return std::lround(static_cast<double>(length) / zoom); };
  const Tensor<float> rgb = zoom < 1 ? resize_area(whole, side(h), side(w)) : whole;
  const float level = nerf::background_value(owner_.field.background);
  std::vector<PartReading> best;
  PartChoice choice;
  for (const ObjectPlace& place : objects_->find(rgb, kWholes, kQuarters)) {
    const PixelBox box = box_of(place);
    const Index longer = std::max(box.width, box.height);
    const double needed = choice.needed(place.whole, longer);
    if (!std::isfinite(needed)) continue;
    ImageReading found = reader_.read_near(cut(rgb, box, 0, {level, level, level}),
                                           camera_of(place.camera, box), needed, beyond(rgb, box));
    if (found.chosen != ReadingKind::informed) continue;
    choice.take(place.whole, longer, found.informed.agreement);
    best = {{{back(box.x), back(box.y), back(box.width), back(box.height)}, std::move(found)}};
    if (choice.is_final()) break;
  }
  return best;
}

}  // namespace fieldmark::watermark
