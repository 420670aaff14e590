#include "outline_match.h"
#include <fieldmark/imaging/resize.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr float kInside = 0.9f;  // least opacity inside the outline
// Mean square of what differs from the mean: a plain place looks like nothing.
constexpr float kLeastPower = 1e-3f;

// The sums over the outline for all places of a row at once.
struct RowSums {
  explicit RowSums(std::size_t places) : product(places), square(places), mean{product, product, product} {}
  std::vector<float> product, square;
  std::array<std::vector<float>, 3> mean;

  void add(const Outline& outline, const ResizedImage& image, Index row, Index first) {
    for (std::size_t k = 0; k < outline.x.size(); ++k) {
      const Index from = (row + outline.y[k]) * image.width + first + outline.x[k];
      const float* squares = image.squares.data() + from;
      for (std::size_t i = 0; i < square.size(); ++i) square[i] += squares[i];
      for (std::size_t c = 0; c < 3; ++c) {
        const float* plane = image.plane[c].data() + from;
        const float t = outline.of_mean[c][k];
        float* sums = mean[c].data();
        for (std::size_t i = 0; i < product.size(); ++i) {
          product[i] += t * plane[i];
          sums[i] += plane[i];
        }
      }
    }
  }
};

// Compares the outline with the places [first, last] of a row.
void match_row(const Outline& outline, const ResizedImage& image, Index row, Index first, Index last,
               OutlineMatch& best) {
  const auto n = static_cast<float>(outline.x.size());
  RowSums sums(static_cast<std::size_t>(last - first + 1));
  sums.add(outline, image, row, first);
  for (std::size_t i = 0; i < sums.product.size(); ++i) {
    float power = sums.square[i];
    for (const auto& mean : sums.mean) power -= mean[i] * mean[i] / n;
    if (!(power > kLeastPower * n)) continue;
    const auto likeness = static_cast<double>(sums.product[i] / std::sqrt(power));
    if (likeness > best.likeness) best = {likeness, row, first + static_cast<Index>(i)};
  }
}

OutlineMatch best_within(const Outline& outline, const ResizedImage& image, Index top, Index bottom,
                         Index left, Index right) {
  OutlineMatch best;
  top = std::max<Index>(0, top), left = std::max<Index>(0, left);
  bottom = std::min(bottom, image.height - outline.height);
  right = std::min(right, image.width - outline.width);
  if (left <= right)
    for (Index row = top; row <= bottom; ++row) match_row(outline, image, row, left, right, best);
  return best;
}

}  // namespace

std::optional<Outline> outline_of(const Tensor<float>& rgb, const Tensor<float>& opacity,
                                  const Window& window, Index grid, Index least) {
  const double zoom = static_cast<double>(grid) / std::max(window.width, window.height);
  const auto side = [&](double length) { return std::max<Index>(1, std::lround(zoom * length)); };
  Outline out{.height = side(window.height), .width = side(window.width), .y = {}, .x = {}, .of_mean = {}};
  const PatchSize size{out.height, out.width};
  const Tensor<float> colour = cut_window(rgb, window, size, 0),
                      inside = cut_window(opacity, window, size, 0);
  for (Index p = 0; p < out.height * out.width; ++p) {
    if (!(inside[3 * p] >= kInside)) continue;
    out.y.push_back(p / out.width);
    out.x.push_back(p % out.width);
    for (Index c = 0; c < 3; ++c) out.of_mean[at(c)].push_back(colour[3 * p + c]);
  }
  if (std::ssize(out.x) < least) return std::nullopt;
  const auto n = static_cast<float>(out.x.size());
  float power = 0;
  for (auto& channel : out.of_mean) {
    float mean = 0;
    for (const float t : channel) mean += t / n;
    for (float& t : channel) t -= mean, power += t * t;
  }
  if (!(power > kLeastPower * n)) return std::nullopt;
  for (auto& channel : out.of_mean)
    for (float& t : channel) t /= std::sqrt(power);
  return out;
}

ResizedImage resized_image(const Tensor<float>& rgb, double zoom) {
  const Index h = rgb.shape[0], w = rgb.shape[1];
  const auto side = [&](Index length) {
    return std::max<Index>(1, std::lround(zoom * static_cast<double>(length)));
  };
  const Tensor<float> small =
      zoom > 1 ? resize_bilinear(rgb, side(h), side(w)) : resize_area(rgb, side(h), side(w));
  ResizedImage out{small.shape[0],
                   small.shape[1],
                   static_cast<double>(small.shape[1]) / static_cast<double>(w),
                   static_cast<double>(small.shape[0]) / static_cast<double>(h),
                   {},
                   {}};
  for (Index p = 0; p < out.height * out.width; ++p) {
    float squares = 0;
    for (Index c = 0; c < 3; ++c) {
      out.plane[at(c)].push_back(small[3 * p + c]);
      squares += small[3 * p + c] * small[3 * p + c];
    }
    out.squares.push_back(squares);
  }
  return out;
}

OutlineMatch best_match(const Outline& outline, const ResizedImage& image) {
  return best_within(outline, image, 0, image.height, 0, image.width);
}

OutlineMatch best_match_near(const Outline& outline, const ResizedImage& image, Index row, Index column,
                             Index reach) {
  return best_within(outline, image, row - reach, row + reach, column - reach, column + reach);
}

}  // namespace fieldmark::watermark
