#include "jpeg_score.h"
#include <fieldmark/distort/jpeg_blocks.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "cut_out.h"
#include "ordered_sum.h"

namespace fieldmark::watermark {
namespace {

using distort::JpegBlock;
using distort::JpegComponent;

constexpr double kDecoding = 0.5;             // standard deviation of a decoder's rounding, levels
constexpr double kOutlier = 0.02;             // share of outlier coefficients ...
constexpr double kOutlierWay = 512;           // ... and their range in levels
constexpr double kNoDensity = 9;              // standard deviations: beyond, the density counts as 0
constexpr double kLeastGain = 50;             // least log-likelihood ratio of a table
constexpr std::size_t kSieve = 16;            // blocks of which one sieves the tables ...
constexpr double kHopeless = -20;             // ... with this log-likelihood ratio
constexpr double kFirst = 0.3, kRatio = 1.5;  // standard deviations tried, levels
constexpr int kDeviations = 13;
constexpr std::array kFactors{0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0};
constexpr Index kBothSides = 16;  // pixels after which blocks of luma and of halved chroma begin together
constexpr Index kSide = 8;        // pixels of a block
constexpr Index kRows = 32, kBlocks = 128;  // of pixels and of coefficients in one piece of work
constexpr Index kSample = 7, kFew = 16;     // blocks of which one tells renders apart, if that leaves so many
constexpr double kOnObject = 32;            // least foreground pixels for a block to count in its band

// One component of an image, in levels; chroma may have half the size.
struct Plane {
  Index height = 0, width = 0;
  std::vector<double> level;
};

Plane component_of(const Tensor<float>& image, int component, Index cell) {
  const auto row = distort::jpeg_colour_row(component);
  const Index h = image.shape[0], w = image.shape[1];
  Plane p{(h + cell - 1) / cell, (w + cell - 1) / cell, {}};
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

Plane decoded_component(const Tensor<float>& image, int component, Index cell) {
  Plane p = component_of(image, component, cell);
  if (cell == 1) return p;
  std::vector<double> work;
  for (Index y = 0; y < p.height; ++y) sharpen(&p.level[at(y * p.width)], p.width, 1, work);
  for (Index x = 0; x < p.width; ++x) sharpen(&p.level[at(x)], p.height, p.width, work);
  return p;
}

// Returns the coefficients of every block; repeats the last row and column to fill blocks.
std::vector<JpegBlock> coefficients(const Plane& p, double middle) {
  const Index down = (p.height + 7) / 8, across = (p.width + 7) / 8;
  std::vector<JpegBlock> out(at(down * across));
  parallel_for(down * across, kBlocks, [&](Index begin, Index end) {
    for (Index b = begin; b < end; ++b) {
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

// log P(n | b) and its slope in b.
struct Likelihood {
  double log_p, slope;
};

Likelihood likelihood(double n, double step, double b, double deviation) {
  const double low = ((n - 0.5) * step - b) / deviation, high = ((n + 0.5) * step - b) / deviation;
  // Subtracts two small tails instead of two numbers near 1.
  const double sign = low + high > 0 ? 1 : -1, near = sign > 0 ? low : -high, far = sign > 0 ? high : -low;
  const double p = 0.5 * (std::erfc(near / std::numbers::sqrt2) - std::erfc(far / std::numbers::sqrt2));
  const double total = (1 - kOutlier) * p + kOutlier * step / kOutlierWay;
  const double bells = std::exp(-0.5 * low * low) - std::exp(-0.5 * high * high);
  return {std::log(total), (1 - kOutlier) * bells / (std::sqrt(2 * std::numbers::pi) * deviation * total)};
}

// Returns the rows and columns from the first whole block on.
Tensor<float> from_first_block(const Tensor<float>& x, const JpegTrace& trace) {
  return cut_out(x, {trace.top, x.shape[0], trace.left, x.shape[1]});
}

// Undoes from_first_block(), with 0 elsewhere.
Tensor<float> back_in_place(const Tensor<float>& x, const Shape& shape, const JpegTrace& trace) {
  Tensor<float> out(shape);
  const Index w = x.shape[1];
  for (Index y = 0; y < x.shape[0]; ++y)
    std::copy_n(x.data.begin() + 3 * y * w, 3 * w,
                out.data.begin() + 3 * ((y + trace.top) * shape[1] + trace.left));
  return out;
}

// Image, render and foreground from the first whole block on.
struct FromFirstBlock {
  FromFirstBlock(const Tensor<float>& whole, const Tensor<float>& whole_render,
                 std::span<const double> whole_object, const JpegTrace& trace)
      : image(from_first_block(whole, trace)), render(from_first_block(whole_render, trace)) {
    for (Index y = trace.top; y < whole.shape[0]; ++y)
      for (Index x = trace.left; x < whole.shape[1]; ++x)
        object.push_back(whole_object[at(y * whole.shape[1] + x)]);
  }
  Tensor<float> image, render;
  std::vector<double> object{};
};

// One component of image, render and mark as coefficients, with their standard deviations.
class ComponentScore {
 public:
  // Counts the blocks on the foreground, or a sample of them.
  ComponentScore(int component, const JpegTrace& trace, const FromFirstBlock& from, bool sample)
      : component_(component),
        cell_(component > 0 && trace.subsampled ? 2 : 1),
        steps_(
            distort::jpeg_steps(component > 0 ? JpegComponent::chroma : JpegComponent::luma, trace.quality)) {
    const double middle = component_ == 0 ? 128 : 0;
    const Plane seen = decoded_component(from.image, component_, cell_);
    width_ = seen.width;
    image_ = coefficients(seen, middle);
    render_ = coefficients(component_of(from.render, component_, cell_), middle);
    count_object(from.object, from.image.shape[1], from.image.shape[0]);
    if (sample) keep_sample();
    fit_deviations();
  }

  double log_likelihood() const {
    return ordered_sum(std::ssize(image_), 0.0, [&](Index begin, Index end, double& sum) {
      for (auto b = at(begin); b < at(end); ++b)
        for (std::size_t k = 0; k < 64 && on_object_[b] > 0; ++k)
          sum += of(b, k, factor_[b] * deviation_[k]).log_p;
    });
  }

  // Adds this component's score and precision.
  void add(const Tensor<float>& mark, JpegScore& out) const {
    const std::vector<JpegBlock> marks = coefficients(component_of(mark, component_, cell_), 0);
    const auto row = distort::jpeg_colour_row(component_);
    const double share = 255 / static_cast<double>(cell_ * cell_);
    const Index h = mark.shape[0], w = mark.shape[1], side = kSide * cell_;
    for (std::size_t b = 0; b < image_.size(); ++b) {
      if (!(on_object_[b] > 0)) continue;
      JpegBlock slopes;
      double information = 0, power = 0;
      for (std::size_t k = 0; k < 64; ++k) {
        slopes[k] = of(b, k, factor_[b] * deviation_[k]).slope;
        information += slopes[k] * slopes[k] * marks[b][k] * marks[b][k];
      }
      const JpegBlock levels = distort::from_jpeg_cosines(slopes);
      const Index top = static_cast<Index>(b) / across() * side,
                  left = static_cast<Index>(b) % across() * side;
      const auto for_values = [&](auto use) {
        for (Index y = top; y < std::min(h, top + side); ++y)
          for (Index x = left; x < std::min(w, left + side); ++x)
            for (Index c = 0; c < 3; ++c)
              use(3 * (y * w + x) + c, at(c), at((y - top) / cell_ * kSide + (x - left) / cell_));
      };
      for_values([&](Index i, std::size_t, std::size_t) { power += static_cast<double>(mark[i] * mark[i]); });
      for_values([&](Index i, std::size_t c, std::size_t place) {
        out.score[i] += static_cast<float>(share * row[c] * levels[place]);
        if (power > 0) out.precision[i] += static_cast<float>(information / power);
      });
    }
  }

 private:
  Index across() const { return (width_ + kSide - 1) / kSide; }

  void count_object(std::span<const double> object, Index w, Index h) {
    on_object_.assign(image_.size(), 0);
    const Index side = kSide * cell_;
    for (Index y = 0; y < h; ++y)
      for (Index x = 0; x < w; ++x)
        on_object_[at((y / side) * across() + x / side)] +=
            object[at(y * w + x)] / static_cast<double>(cell_ * cell_);
  }

  void keep_sample() {
    const auto much = [](double pixels) { return pixels >= kOnObject; };
    if (std::ranges::count_if(on_object_, much) < kSample * kFew) return;
    Index seen = 0;
    for (double& pixels : on_object_)
      if (!much(pixels) || seen++ % kSample != 0) pixels = 0;
  }

  Likelihood of(std::size_t block, std::size_t k, double deviation) const {
    return likelihood(std::round(image_[block][k] / steps_[k]), steps_[k], render_[block][k], deviation);
  }

  // Maximum likelihood, first per band, then per block.
  void fit_deviations() {
    parallel_for(64, 1, [&](Index begin, Index end) {
      for (auto k = at(begin); k < at(end); ++k) {
        double best = 0;
        for (int d = 0; d < kDeviations; ++d) {
          const double deviation = kFirst * std::pow(kRatio, d);
          double sum = 0;
          for (std::size_t b = 0; b < image_.size(); ++b)
            if (on_object_[b] >= kOnObject) sum += of(b, k, deviation).log_p;
          if (d > 0 && sum <= best) continue;
          best = sum;
          deviation_[k] = deviation;
        }
      }
    });
    factor_.assign(image_.size(), 1);
    parallel_for(static_cast<Index>(image_.size()), 16, [&](Index begin, Index end) {
      for (auto b = at(begin); b < at(end); ++b) {
        if (!(on_object_[b] > 0)) continue;
        double best = 0;
        for (const double factor : kFactors) {
          double sum = 0;
          for (std::size_t k = 0; k < 64; ++k) sum += of(b, k, factor * deviation_[k]).log_p;
          if (factor > kFactors.front() && sum <= best) continue;
          best = sum;
          factor_[b] = factor;
        }
      }
    });
  }

  int component_;
  Index cell_, width_ = 0;
  JpegBlock steps_;
  std::vector<JpegBlock> image_, render_;
  std::vector<double> on_object_, factor_;  // [blocks] foreground pixels; factor on the band's deviation
  JpegBlock deviation_{};
};

void check_fit(const char* op, const char* what, const Tensor<float>& image, const Tensor<float>& fits,
               std::span<const double> object) {
  check_rank(op, "image", image.shape, 3, "[H, W, 3]");
  check_extent(op, "image", image.shape, 2, 3, "red, green, blue");
  if (fits.shape != image.shape || 3 * std::ssize(object) != image.size())
    throw ShapeError("[" + std::string(op) + "] " + what + " and object must fit the image " +
                     image.shape.str() + ", got " + fits.shape.str() + " and " +
                     std::to_string(object.size()) + " pixels");
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
  const auto luma = unclipped(coefficients(component_of(image, 0, 1), 128), image, kSide);
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
          unclipped(coefficients(decoded_component(image, component, cell), 0), image, kSide * cell), steps);
  trace.subsampled = chroma[1] >= chroma[0];
  return trace;
}

double jpeg_log_likelihood(const Tensor<float>& image, const Tensor<float>& render,
                           std::span<const double> object, const JpegTrace& trace) {
  check_fit("jpeg_log_likelihood", "render", image, render, object);
  const FromFirstBlock from(image, render, object, trace);
  double sum = 0;
  for (const int component : {0, 1, 2}) sum += ComponentScore(component, trace, from, true).log_likelihood();
  return sum;
}

JpegScore jpeg_score(const Tensor<float>& image, const Tensor<float>& render, const Tensor<float>& mark,
                     std::span<const double> object, const JpegTrace& trace) {
  check_fit("jpeg_score", "render", image, render, object);
  check_fit("jpeg_score", "mark", image, mark, object);
  const FromFirstBlock from(image, render, object, trace);
  const Tensor<float> part = from_first_block(mark, trace);
  JpegScore of_part{Tensor<float>(part.shape), Tensor<float>(part.shape)};
  for (const int component : {0, 1, 2}) ComponentScore(component, trace, from, false).add(part, of_part);
  return {back_in_place(of_part.score, image.shape, trace),
          back_in_place(of_part.precision, image.shape, trace)};
}

}  // namespace fieldmark::watermark
