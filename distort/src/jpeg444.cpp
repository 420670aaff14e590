#include "fieldmark/distort/jpeg444.h"

#include <fieldmark/engine/image.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "checks.h"

namespace fieldmark::distort {
namespace {

using Block = std::array<double, 64>;  // row-major

constexpr std::array<int, 64> kLuma{16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,
                                    14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,
                                    18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,
                                    49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};
constexpr std::array<int, 64> kChroma{17, 18, 24, 47, 99, 99, 99, 99, 18, 21, 26, 66, 99, 99, 99, 99,
                                      24, 26, 56, 99, 99, 99, 99, 99, 47, 66, 99, 99, 99, 99, 99, 99,
                                      99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
                                      99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99};

Block scaled(const std::array<int, 64>& base, int quality) {
  const int s = quality < 50 ? 5000 / quality : 200 - 2 * quality;
  Block q;
  for (std::size_t i = 0; i < 64; ++i) q[i] = std::clamp((s * base[i] + 50) / 100, 1, 255);
  return q;
}

// Rows are the orthonormal cosines of the transform (T.81, A.3.3).
Block cosines() {
  Block a;
  for (std::size_t u = 0; u < 8; ++u)
    for (std::size_t x = 0; x < 8; ++x)
      a[8 * u + x] =
          (u == 0 ? std::sqrt(0.125) : 0.5) *
          std::cos((2 * static_cast<double>(x) + 1) * static_cast<double>(u) * std::numbers::pi / 16);
  return a;
}

// a b a^T, or a^T b a where a is transposed.
Block transformed(const Block& a, const Block& b, bool transposed) {
  const auto at = [&](std::size_t i, std::size_t k) { return transposed ? a[8 * k + i] : a[8 * i + k]; };
  Block half{}, out{};
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t k = 0; k < 8; ++k)
      for (std::size_t j = 0; j < 8; ++j) half[8 * i + j] += at(i, k) * b[8 * k + j];
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t j = 0; j < 8; ++j)
      for (std::size_t k = 0; k < 8; ++k) out[8 * i + j] += half[8 * i + k] * at(j, k);
  return out;
}

void quantise(Block& block, const Block& cosine, const Block& table) {
  for (double& v : block) v -= 128;
  Block c = transformed(cosine, block, false);
  for (std::size_t i = 0; i < 64; ++i) c[i] = table[i] * std::round(c[i] / table[i]);
  block = transformed(cosine, c, true);
  for (double& v : block) v = std::clamp(std::round(v + 128), 0.0, 255.0);
}

// JFIF: Y, Cb and Cr of bytes, and back.
std::array<double, 3> to_components(const float* rgb) {
  const double r = 255 * static_cast<double>(rgb[0]), g = 255 * static_cast<double>(rgb[1]),
               b = 255 * static_cast<double>(rgb[2]);
  return {0.299 * r + 0.587 * g + 0.114 * b, 128 + (-0.299 * r - 0.587 * g + 0.886 * b) / 1.772,
          128 + (0.701 * r - 0.587 * g - 0.114 * b) / 1.402};
}
void to_colour(double y, double cb, double cr, float* rgb) {
  const double blue = 1.772 * (cb - 128), red = 1.402 * (cr - 128);
  const std::array<double, 3> v{y + red, y - (0.114 * blue + 0.299 * red) / 0.587, y + blue};
  std::transform(v.begin(), v.end(), rgb, [](double x) { return static_cast<float>(x / 255); });
}

}  // namespace

Tensor<float> jpeg444(const Tensor<float>& image, int quality) {
  check_rank("jpeg444", "image", image.shape, 3, "[height, width, 3]");
  check_extent("jpeg444", "image", image.shape, 2, 3, "red, green and blue");
  if (image.size() == 0)
    throw ShapeError("[jpeg444] image: must have at least one pixel, got shape " + image.shape.str());
  check_range("jpeg444", "quality", quality, 1, 100, "as libjpeg counts");
  const Index h = image.shape[0], w = image.shape[1];
  const Block cosine = cosines(), luma = scaled(kLuma, quality), chroma = scaled(kChroma, quality);
  const Tensor<float> in = quantize8(image);
  Tensor<float> out(image.shape);
  parallel_for((h + 7) / 8, 1, [&](Index begin, Index end) {
    std::array<Block, 3> blocks;
    for (Index top = 8 * begin; top < std::min(8 * end, h); top += 8)
      for (Index left = 0; left < w; left += 8) {
        for (Index i = 0; i < 64; ++i) {
          const Index row = std::min(top + i / 8, h - 1), column = std::min(left + i % 8, w - 1);
          const auto c = to_components(in.data.data() + 3 * (row * w + column));
          for (std::size_t k = 0; k < 3; ++k) blocks[k][static_cast<std::size_t>(i)] = c[k];
        }
        for (std::size_t k = 0; k < 3; ++k) quantise(blocks[k], cosine, k == 0 ? luma : chroma);
        for (Index i = 0; i < 64; ++i) {
          const Index row = top + i / 8, column = left + i % 8;
          const auto p = static_cast<std::size_t>(i);
          if (row < h && column < w)
            to_colour(blocks[0][p], blocks[1][p], blocks[2][p], out.data.data() + 3 * (row * w + column));
        }
      }
  });
  return quantize8(out);
}

}  // namespace fieldmark::distort
