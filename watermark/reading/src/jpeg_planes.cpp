#include "jpeg_planes.h"
#include <fieldmark/engine/parallel.h>

#include <algorithm>

#include "cut_out.h"

namespace fieldmark::watermark {

using distort::JpegBlock;

namespace {

constexpr Index kRows = 32, kBlocks = 128;  // of pixels and of coefficients in one piece of work

// Inverts a decoder's chroma upsampling along one line. The decoder makes two pixels of one with weights 3/4
// and 1/4 (the neighbour's), whose mean has weights 1/8, 3/4, 1/8: a tridiagonal system (Thomas algorithm).
void sharpen(double* line, Index n, Index step, std::vector<double>& above) {
  if (n < 2) return;
  above.assign(at(n), 0);
  double pivot = 0.875;
  line[0] /= pivot;
  for (Index i = 1; i < n; ++i) {
    above[at(i - 1)] = 0.125 / pivot;
    pivot = (i + 1 < n ? 0.75 : 0.875) - 0.125 * above[at(i - 1)];
    line[i * step] = (line[i * step] - 0.125 * line[(i - 1) * step]) / pivot;
  }
  for (Index i = n - 2; i >= 0; --i) line[i * step] -= above[at(i)] * line[(i + 1) * step];
}

}  // namespace

Tensor<float> from_first_block(const Tensor<float>& x, const JpegTrace& trace) {
  return cut_out(x, {trace.top, x.shape[0], trace.left, x.shape[1]});
}

JpegPlane component_of(const Tensor<float>& image, int component, Index cell) {
  const auto row = distort::jpeg_colour_row(component);
  const Index h = image.shape[0], w = image.shape[1];
  JpegPlane p{(h + cell - 1) / cell, (w + cell - 1) / cell, {}};
  p.level.resize(at(p.height * p.width));
  const double share = 255 / static_cast<double>(cell * cell);
  parallel_for(p.height, kRows, [&](Index begin, Index end) {
    for (Index y = begin * cell; y < end * cell; ++y)
      for (Index x = 0; x < p.width * cell; ++x) {
        const float* rgb = image.data.data() + 3 * (std::min(y, h - 1) * w + std::min(x, w - 1));
        double& out = p.level[at((y / cell) * p.width + x / cell)];
        for (std::size_t c = 0; c < 3; ++c) out += share * row[c] * static_cast<double>(rgb[c]);
      }
  });
  return p;
}

JpegPlane decoded_component(const Tensor<float>& image, int component, Index cell) {
  JpegPlane p = component_of(image, component, cell);
  if (cell == 1 || p.level.empty()) return p;
  std::vector<double> work;
  for (Index y = 0; y < p.height; ++y) sharpen(&p.level[at(y * p.width)], p.width, 1, work);
  for (Index x = 0; x < p.width; ++x) sharpen(&p.level[at(x)], p.height, p.width, work);
  return p;
}

std::vector<JpegBlock> jpeg_coefficients(const JpegPlane& p, double middle, std::span<const double> used) {
  const Index down = (p.height + 7) / 8, across = (p.width + 7) / 8;
  std::vector<JpegBlock> out(at(down * across));
  parallel_for(down * across, kBlocks, [&](Index begin, Index end) {
    for (Index b = begin; b < end; ++b) {
      if (!used.empty() && !(used[at(b)] > 0)) continue;
      JpegBlock levels;
      for (Index i = 0; i < 64; ++i) {
        const Index y = std::min(8 * (b / across) + i / 8, p.height - 1),
                    x = std::min(8 * (b % across) + i % 8, p.width - 1);
        levels[at(i)] = p.level[at(y * p.width + x)] - middle;
      }
      out[at(b)] = distort::jpeg_cosines(levels);
    }
  });
  return out;
}

}  // namespace fieldmark::watermark
