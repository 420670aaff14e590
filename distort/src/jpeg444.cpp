#include "fieldmark/distort/jpeg444.h"

#include <fieldmark/distort/jpeg_blocks.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "checks.h"

namespace fieldmark::distort {
namespace {

void quantise(JpegBlock& block, const JpegBlock& table) {
  for (double& v : block) v -= 128;
  JpegBlock c = jpeg_cosines(block);
  for (std::size_t i = 0; i < 64; ++i) c[i] = table[i] * std::round(c[i] / table[i]);
  block = from_jpeg_cosines(c);
  for (double& v : block) v = std::clamp(std::round(v + 128), 0.0, 255.0);
}

// JFIF: converts RGB bytes to Y, Cb and Cr, and back.
std::array<double, 3> to_components(const float* rgb) {
  std::array<double, 3> out{0, 128, 128};
  for (int k = 0; k < 3; ++k) {
    const auto row = jpeg_colour_row(k);
    for (std::size_t c = 0; c < 3; ++c)
      out[static_cast<std::size_t>(k)] += 255 * row[c] * static_cast<double>(rgb[c]);
  }
  return out;
}
void to_colour(double y, double cb, double cr, float* rgb) {
  const double blue = 1.772 * (cb - 128), red = 1.402 * (cr - 128);
  const std::array<double, 3> v{y + red, y - (0.114 * blue + 0.299 * red) / 0.587, y + blue};
  std::transform(v.begin(), v.end(), rgb, [](double x) { return static_cast<float>(x / 255); });
}

}  // namespace

Tensor<float> jpeg444(const Tensor<float>& image, int quality) {
  check_colours("jpeg444", image.shape);
  check_range("jpeg444", "quality", quality, 1, 100, "as libjpeg counts");
  const Index h = image.shape[0], w = image.shape[1];
  const JpegBlock luma = jpeg_steps(JpegComponent::luma, quality),
                  chroma = jpeg_steps(JpegComponent::chroma, quality);
  const Tensor<float> in = quantize8(image);
  Tensor<float> out(image.shape);
  parallel_for((h + 7) / 8, 1, [&](Index begin, Index end) {
    std::array<JpegBlock, 3> blocks;
    for (Index top = 8 * begin; top < std::min(8 * end, h); top += 8)
      for (Index left = 0; left < w; left += 8) {
        for (Index i = 0; i < 64; ++i) {
          const Index row = std::min(top + i / 8, h - 1), column = std::min(left + i % 8, w - 1);
          const auto c = to_components(in.data.data() + 3 * (row * w + column));
          for (std::size_t k = 0; k < 3; ++k) blocks[k][static_cast<std::size_t>(i)] = c[k];
        }
        for (std::size_t k = 0; k < 3; ++k) quantise(blocks[k], k == 0 ? luma : chroma);
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
