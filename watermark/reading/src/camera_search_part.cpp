#include <fieldmark/engine/parallel.h>

#include <array>
#include <cmath>

#include "camera_proposal.h"

// CameraSearch by the image as a part of a render.
namespace fieldmark::watermark {
namespace {

constexpr Index kParts = 12;                                     // a side, of image and windows
constexpr std::array kSides{0.5, 0.57, 0.64, 0.72, 0.81, 0.92};  // of the longer side of the render
constexpr double kStride = 0.04;                                 // between windows, of the same

}  // namespace

CameraSearch::Proposal CameraSearch::best_part(std::size_t number, std::span<const float> image,
                                               double height_to_width) const {
  const SummedArea& area = views_[number].area;
  const double longer = static_cast<double>(std::max(area.height(), area.width()));
  std::vector<float> parts(image.size());
  Proposal best{number};
  for (const double side : kSides) {
    const double wide = side * longer / std::max(1.0, height_to_width), high = wide * height_to_width;
    for (double top = 0; top + high <= static_cast<double>(area.height()); top += kStride * longer)
      for (double left = 0; left + wide <= static_cast<double>(area.width()); left += kStride * longer) {
        area.means(left, top, wide, high, kParts, parts);
        make_unit(parts);
        double score = 0;
        for (std::size_t i = 0; i < parts.size(); ++i) score += static_cast<double>(parts[i] * image[i]);
        if (score > best.score) best = {number, 1 / wide, Complex(-left, -top) / wide, score};
      }
  }
  return best;
}

std::vector<nerf::Camera> CameraSearch::find_part(const Tensor<float>& image, Index count) const {
  const Index h = image.shape[0], w = image.shape[1];
  std::vector<float> parts(static_cast<std::size_t>(kParts * kParts * 3));
  SummedArea(image).means(0, 0, static_cast<double>(w), static_cast<double>(h), kParts, parts);
  make_unit(parts);
  std::vector<Proposal> best(views_.size());
  parallel_for(static_cast<Index>(views_.size()), 8, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v)
      best[static_cast<std::size_t>(v)] =
          best_part(static_cast<std::size_t>(v), parts, static_cast<double>(h) / static_cast<double>(w));
  });
  for (Proposal& p : best) {
    p.a *= static_cast<double>(w);
    p.b *= static_cast<double>(w);
  }
  return best_cameras(best, h, w, count);
}

}  // namespace fieldmark::watermark
