#include "plain_border.h"
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/flood_fill.h>

#include <algorithm>
#include <cmath>

#include "blurred.h"

namespace fieldmark::watermark {
namespace {

constexpr double kBorderBlurs[] = {0.5, 3};  // standard deviations, pixels
constexpr Index kBorderAround = 6;           // pixels
constexpr float kAlike = 0.06f;              // in every channel

// Flood fill from a corner.
std::vector<Index> region(const Tensor<float>& image, Index corner) {
  const Index h = image.shape[0], w = image.shape[1];
  const auto alike = [&](Index p) {
    for (Index a = 0; a < 3; ++a)
      if (!(std::abs(image[3 * p + a] - image[3 * corner + a]) <= kAlike)) return false;
    return true;
  };
  return flood_fill(h, w, std::span(&corner, 1), alike);
}

}  // namespace

std::vector<std::uint8_t> plain_border(const Tensor<float>& image) {
  check_rank("plain_border", "image", image.shape, 3, "[H, W, 3]");
  check_extent("plain_border", "image", image.shape, 2, 3, "red, green, blue");
  const Index h = image.shape[0], w = image.shape[1];
  std::vector<std::uint8_t> border(at(h * w));
  if (h * w == 0) return border;
  for (const double blur : kBorderBlurs) {
    const Tensor<float> soft = blurred(image, blur);
    for (const Index corner : {Index{0}, w - 1, (h - 1) * w, h * w - 1})
      for (const Index p : region(soft, corner)) border[at(p)] = 1;
  }
  return border_at(border, h, w, h, w, kBorderAround);
}

std::vector<std::uint8_t> border_of(const nerf::RadianceField& field, const Tensor<float>& image) {
  if (field.space.kind == nerf::SpaceKind::cube) return {};
  return plain_border(image);
}

std::vector<std::uint8_t> border_at(const std::vector<std::uint8_t>& border, Index height, Index width,
                                    Index to_height, Index to_width, Index reach) {
  if (height < 1 || width < 1 || to_height < 1 || to_width < 1 || std::ssize(border) != height * width)
    throw ShapeError("[border_at] sizes must be at least 1 and border [H W], got " + std::to_string(height) +
                     " x " + std::to_string(width) + " to " + std::to_string(to_height) + " x " +
                     std::to_string(to_width) + " and " + std::to_string(border.size()) + " numbers");
  std::vector<std::uint8_t> out(at(to_height * to_width));
  for (Index p = 0; p < height * width; ++p) {
    if (!border[at(p)]) continue;
    const Index y = p / width * to_height / height, x = p % width * to_width / width;
    for (Index v = std::max<Index>(0, y - reach); v <= std::min(to_height - 1, y + reach); ++v)
      std::fill_n(out.begin() + v * to_width + std::max<Index>(0, x - reach),
                  std::min(to_width - 1, x + reach) - std::max<Index>(0, x - reach) + 1, std::uint8_t{1});
  }
  return out;
}

}  // namespace fieldmark::watermark
