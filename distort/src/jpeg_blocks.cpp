#include "fieldmark/distort/jpeg_blocks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "checks.h"

namespace fieldmark::distort {
namespace {

constexpr std::array<int, 64> kLuma{16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,
                                    14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,
                                    18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,
                                    49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};
constexpr std::array<int, 64> kChroma{17, 18, 24, 47, 99, 99, 99, 99, 18, 21, 26, 66, 99, 99, 99, 99,
                                      24, 26, 56, 99, 99, 99, 99, 99, 47, 66, 99, 99, 99, 99, 99, 99,
                                      99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99,
                                      99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99, 99};

// The rows are the cosines.
const JpegBlock& cosines() {
  static const JpegBlock rows = [] {
    JpegBlock a;
    for (std::size_t u = 0; u < 8; ++u)
      for (std::size_t x = 0; x < 8; ++x)
        a[8 * u + x] =
            (u == 0 ? std::sqrt(0.125) : 0.5) *
            std::cos((2 * static_cast<double>(x) + 1) * static_cast<double>(u) * std::numbers::pi / 16);
    return a;
  }();
  return rows;
}

// Computes a b a^T, or a^T b a if `transposed`.
JpegBlock transformed(const JpegBlock& b, bool transposed) {
  const JpegBlock& a = cosines();
  const auto at = [&](std::size_t i, std::size_t k) { return transposed ? a[8 * k + i] : a[8 * i + k]; };
  JpegBlock half{}, out{};
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t k = 0; k < 8; ++k)
      for (std::size_t j = 0; j < 8; ++j) half[8 * i + j] += at(i, k) * b[8 * k + j];
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t j = 0; j < 8; ++j)
      for (std::size_t k = 0; k < 8; ++k) out[8 * i + j] += half[8 * i + k] * at(j, k);
  return out;
}

}  // namespace

JpegBlock jpeg_steps(JpegComponent component, int quality) {
  check_range("jpeg_steps", "quality", quality, 1, 100, "as libjpeg counts");
  const auto& base = component == JpegComponent::luma ? kLuma : kChroma;
  const int s = quality < 50 ? 5000 / quality : 200 - 2 * quality;
  JpegBlock q;
  for (std::size_t i = 0; i < 64; ++i) q[i] = std::clamp((s * base[i] + 50) / 100, 1, 255);
  return q;
}

JpegBlock jpeg_cosines(const JpegBlock& levels) { return transformed(levels, false); }

JpegBlock from_jpeg_cosines(const JpegBlock& coefficients) { return transformed(coefficients, true); }

std::array<double, 3> jpeg_colour_row(int component) {
  switch (component) {
    case 0:
      return {0.299, 0.587, 0.114};
    case 1:
      return {-0.299 / 1.772, -0.587 / 1.772, 0.886 / 1.772};
    default:
      return {0.701 / 1.402, -0.587 / 1.402, -0.114 / 1.402};
  }
}

}  // namespace fieldmark::distort
