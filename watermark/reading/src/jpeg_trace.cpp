#include "jpeg_trace.h"
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "quantised_coefficient.h"

namespace fieldmark::watermark {
namespace {

using distort::JpegBlock;
using distort::JpegComponent;

constexpr double kDecoding = 0.5;   // standard deviation of a decoder's rounding, levels
constexpr double kNoDensity = 9;    // standard deviations: beyond, the density counts as 0
constexpr double kLeastGain = 50;   // least log-likelihood ratio of a table
constexpr std::size_t kSieve = 16;  // blocks of which one sieves the tables ...
constexpr double kHopeless = -20;   // ... with this log-likelihood ratio
constexpr Index kBothSides = 16;    // pixels after which blocks of luma and of halved chroma begin together

// Leaves out the blocks of an image, of so many pixels a side, in which the decoder may have clipped a value.
std::vector<JpegBlock> unclipped(const std::vector<JpegBlock>& blocks, const Tensor<float>& image,
                                 Index side) {
  const Index h = image.shape[0], w = image.shape[1], across = (w + side - 1) / side;
  const auto clipped = [](float x) { return x <= 0 || x >= 1; };
  std::vector<JpegBlock> out;
  for (Index b = 0; b < std::ssize(blocks); ++b) {
    const Index top = b / across * side, left = b % across * side, columns = std::min(w, left + side) - left;
    bool whole = true;
    for (Index y = top; y < std::min(h, top + side); ++y)
      whole = whole &&
              std::none_of(&image[3 * (y * w + left)], &image[3 * (y * w + left)] + 3 * columns, clipped);
    if (whole) out.push_back(blocks[at(b)]);
  }
  return out;
}

// Returns the log-likelihood ratio of a table of steps for the nonzero coefficients of every `stride`-th
// block, against a uniform density.
double explained(const std::vector<JpegBlock>& blocks, const JpegBlock& steps, std::size_t stride = 1) {
  double sum = 0;
  for (std::size_t b = 0; b < blocks.size(); b += stride) {
    const JpegBlock& c = blocks[b];
    double ratio = 1;  // product over a block: 63 factors in [0.02, 200], so in [1e-107, 1e145]
    for (std::size_t k = 1; k < 64; ++k) {
      if (2 * std::abs(c[k]) < steps[k]) continue;
      const double d = (c[k] - std::round(c[k] / steps[k]) * steps[k]) / kDecoding;
      const double density = std::abs(d) < kNoDensity
                                 ? std::exp(-0.5 * d * d) / (kDecoding * std::sqrt(2 * std::numbers::pi))
                                 : 0;
      ratio *= kOutlier + (1 - kOutlier) * steps[k] * density;
    }
    sum += std::log(ratio);
  }
  return sum;
}

}  // namespace

std::optional<JpegTrace> find_jpeg(const Tensor<float>& whole, Index left, Index top) {
  check_rank("find_jpeg", "image", whole.shape, 3, "[H, W, 3]");
  check_extent("find_jpeg", "image", whole.shape, 2, 3, "red, green, blue");
  if (left < 0 || top < 0)
    throw ValueError("[find_jpeg] left and top must be at least 0, got " + std::to_string(left) + " and " +
                     std::to_string(top));
  const auto next = [](Index cut) { return (kBothSides - cut % kBothSides) % kBothSides; };
  JpegTrace trace{.left = next(left), .top = next(top)};
  const Tensor<float> image = from_first_block(whole, trace);
  if (image.size() == 0) return std::nullopt;
  const auto luma = unclipped(jpeg_coefficients(component_of(image, 0, 1), 128), image, kJpegSide);
  std::array<double, 101> gain{};
  parallel_for(100, 1, [&](Index begin, Index end) {
    for (Index q = begin + 1; q <= end; ++q) {
      const JpegBlock steps = distort::jpeg_steps(JpegComponent::luma, static_cast<int>(q));
      // Most tables are far from any that was used, and a few blocks tell.
      if (luma.size() > 8 * kSieve && explained(luma, steps, kSieve) < kHopeless) continue;
      gain[at(q)] = explained(luma, steps);
    }
  });
  const auto best = std::max_element(gain.begin() + 1, gain.end());
  if (*best < kLeastGain) return std::nullopt;
  trace.quality = static_cast<int>(best - gain.begin());
  const JpegBlock steps = distort::jpeg_steps(JpegComponent::chroma, trace.quality);
  std::array<double, 2> chroma{};
  for (const Index cell : {1, 2})
    for (const int component : {1, 2})
      chroma[at(cell - 1)] += explained(
          unclipped(jpeg_coefficients(decoded_component(image, component, cell), 0), image, kJpegSide * cell),
          steps);
  trace.subsampled = chroma[1] >= chroma[0];
  return trace;
}

}  // namespace fieldmark::watermark
