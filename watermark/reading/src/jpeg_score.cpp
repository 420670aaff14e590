#include "jpeg_score.h"
#include <fieldmark/distort/jpeg_blocks.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "highest.h"
#include "jpeg_planes.h"
#include "ordered_sum.h"
#include "quantised_coefficient.h"

namespace fieldmark::watermark {
namespace {

using distort::JpegBlock;
using distort::JpegComponent;

// Standard deviations tried, levels.
constexpr std::array kDeviations = [] {
  std::array<double, 13> d{0.3};
  for (std::size_t i = 1; i < d.size(); ++i) d[i] = 1.5 * d[i - 1];
  return d;
}();
constexpr std::array kFactors{0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0};
constexpr Index kSample = 7, kFew = 16;  // blocks of which one tells renders apart, if that leaves so many
constexpr double kOnObject = 32;         // least foreground pixels for a block to count in its band

// Undoes from_first_block(), with 0 elsewhere.
Tensor<float> back_in_place(const Tensor<float>& x, const Shape& shape, const JpegTrace& trace) {
  Tensor<float> out(shape);
  const Index w = x.shape[1];
  for (Index y = 0; y < x.shape[0]; ++y)
    std::copy_n(x.data.begin() + 3 * y * w, 3 * w,
                out.data.begin() + 3 * ((y + trace.top) * shape[1] + trace.left));
  return out;
}

}  // namespace

// One component of the image as coefficients, from the first whole block on.
struct QuantisedComponent {
  QuantisedComponent(int component, const Tensor<float>& image, std::span<const double> object,
                     const JpegTrace& trace)
      : index(component),
        cell(component > 0 && trace.subsampled ? 2 : 1),
        steps(
            distort::jpeg_steps(component > 0 ? JpegComponent::chroma : JpegComponent::luma, trace.quality)) {
    const JpegPlane plane = decoded_component(image, index, cell);
    across = (plane.width + kJpegSide - 1) / kJpegSide;
    number = jpeg_coefficients(plane, middle());
    for (JpegBlock& block : number)
      for (std::size_t k = 0; k < 64; ++k) block[k] = std::round(block[k] / steps[k]);
    count_object(object, image.shape[1], image.shape[0]);
    keep_sample();
  }
  double middle() const { return index == 0 ? 128 : 0; }

  int index;
  Index cell, across = 0;  // pixels to a value's side; blocks to a row
  JpegBlock steps;
  std::vector<JpegBlock> number;          // of steps
  std::vector<double> on_object, sample;  // [blocks] foreground values; the same of every seventh, else 0

 private:
  void count_object(std::span<const double> object, Index w, Index h) {
    on_object.assign(number.size(), 0);
    const Index side = kJpegSide * cell;
    for (Index y = 0; y < h; ++y)
      for (Index x = 0; x < w; ++x)
        on_object[at((y / side) * across + x / side)] +=
            object[at(y * w + x)] / static_cast<double>(cell * cell);
  }

  void keep_sample() {
    const auto much = [](double pixels) { return pixels >= kOnObject; };
    sample = on_object;
    if (std::ranges::count_if(on_object, much) < kSample * kFew) return;
    Index seen = 0;
    for (double& pixels : sample)
      if (!much(pixels) || seen++ % kSample != 0) pixels = 0;
  }
};

namespace {

// A render against one component of the image, with the standard deviations that fit.
class ComponentScore {
 public:
  // Counts the blocks that have foreground pixels.
  ComponentScore(const QuantisedComponent& seen, const Tensor<float>& render,
                 const std::vector<double>& on_object)
      : component_(seen.index),
        cell_(seen.cell),
        across_(seen.across),
        steps_(seen.steps),
        number_(seen.number),
        on_object_(on_object),
        render_(jpeg_coefficients(component_of(render, seen.index, seen.cell), seen.middle(), on_object)) {
    fit_deviations();
  }

  double log_likelihood() const {
    return ordered_sum(std::ssize(number_), 0.0, [&](Index begin, Index end, double& sum) {
      for (auto b = at(begin); b < at(end); ++b)
        if (on_object_[b] > 0) sum += log_probability(b, factor_[b]);
    });
  }

  // Adds this component's score and precision.
  void add(const Tensor<float>& mark, JpegScore& out) const {
    const std::vector<JpegBlock> marks =
        jpeg_coefficients(component_of(mark, component_, cell_), 0, on_object_);
    const auto row = distort::jpeg_colour_row(component_);
    const double share = 255 / static_cast<double>(cell_ * cell_);
    const Index h = mark.shape[0], w = mark.shape[1], side = kJpegSide * cell_;
    for (std::size_t b = 0; b < number_.size(); ++b) {
      if (!(on_object_[b] > 0)) continue;
      JpegBlock slopes;
      double information = 0, power = 0;
      for (std::size_t k = 0; k < 64; ++k) {
        const double deviation = factor_[b] * deviation_[k];
        slopes[k] = log_slope(interval(b, k, deviation), steps_[k], deviation);
        information += slopes[k] * slopes[k] * marks[b][k] * marks[b][k];
      }
      const JpegBlock levels = distort::from_jpeg_cosines(slopes);
      const Index top = static_cast<Index>(b) / across_ * side, left = static_cast<Index>(b) % across_ * side;
      const auto for_values = [&](auto use) {
        for (Index y = top; y < std::min(h, top + side); ++y)
          for (Index x = left; x < std::min(w, left + side); ++x)
            for (Index c = 0; c < 3; ++c)
              use(3 * (y * w + x) + c, at(c), at((y - top) / cell_ * kJpegSide + (x - left) / cell_));
      };
      for_values([&](Index i, std::size_t, std::size_t) { power += static_cast<double>(mark[i] * mark[i]); });
      for_values([&](Index i, std::size_t c, std::size_t place) {
        out.score[i] += static_cast<float>(share * row[c] * levels[place]);
        if (power > 0) out.precision[i] += static_cast<float>(information / power);
      });
    }
  }

 private:
  RoundingInterval interval(std::size_t block, std::size_t k, double deviation) const {
    return {number_[block][k], steps_[k], render_[block][k], deviation};
  }

  double log_probability(std::size_t block, double factor) const {
    LogProduct product;
    for (std::size_t k = 0; k < 64; ++k)
      product.times(probability(interval(block, k, factor * deviation_[k]), steps_[k]));
    return product.value();
  }

  // Maximum likelihood, first per band, then per block. Outliers may make several maxima.
  void fit_deviations() {
    parallel_for(64, 1, [&](Index begin, Index end) {
      for (auto k = at(begin); k < at(end); ++k) {
        const auto fit = [&](std::size_t d) {
          LogProduct product;
          for (std::size_t b = 0; b < number_.size(); ++b)
            if (on_object_[b] >= kOnObject)
              product.times(probability(interval(b, k, kDeviations[d]), steps_[k]));
          return product.value();
        };
        deviation_[k] = kDeviations[highest(kDeviations.size(), fit)];
      }
    });
    factor_.assign(number_.size(), 1);
    parallel_for(static_cast<Index>(number_.size()), 16, [&](Index begin, Index end) {
      for (auto b = at(begin); b < at(end); ++b)
        if (on_object_[b] > 0)
          factor_[b] = kFactors[highest(kFactors.size(),
                                        [&](std::size_t f) { return log_probability(b, kFactors[f]); })];
    });
  }

  int component_;
  Index cell_, across_;
  const JpegBlock& steps_;
  const std::vector<JpegBlock>& number_;
  const std::vector<double>& on_object_;
  std::vector<JpegBlock> render_;
  JpegBlock deviation_{};
  std::vector<double> factor_{};  // [blocks] on the band's deviation
};

void check_fit(const char* what, const Shape& image, const Tensor<float>& fits) {
  if (fits.shape != image)
    throw ShapeError("[jpeg_image] " + std::string(what) + " must have the image's shape " + image.str() +
                     ", got " + fits.shape.str());
}

}  // namespace

JpegImage::JpegImage(const Tensor<float>& image, std::span<const double> object, const JpegTrace& trace)
    : shape_(image.shape), trace_(trace) {
  check_rank("jpeg_image", "image", shape_, 3, "[H, W, 3]");
  check_extent("jpeg_image", "image", shape_, 2, 3, "red, green, blue");
  const Index h = shape_[0], w = shape_[1];
  if (std::ssize(object) != h * w)
    throw ShapeError("[jpeg_image] object must have a value for each pixel of image " + shape_.str() +
                     ", got " + std::to_string(object.size()));
  if (trace.left < 0 || trace.top < 0 || trace.left >= w || trace.top >= h)
    throw ValueError("[jpeg_image] left and top must be inside image " + shape_.str() + ", got " +
                     std::to_string(trace.left) + " and " + std::to_string(trace.top));
  const Tensor<float> whole_blocks = from_first_block(image, trace);
  std::vector<double> in_blocks;
  for (Index y = trace.top; y < h; ++y)
    for (Index x = trace.left; x < w; ++x) in_blocks.push_back(object[at(y * w + x)]);
  for (const int component : {0, 1, 2}) components_.emplace_back(component, whole_blocks, in_blocks, trace);
}

JpegImage::~JpegImage() = default;

double JpegImage::log_likelihood(const Tensor<float>& render) const {
  check_fit("render", shape_, render);
  const Tensor<float> part = from_first_block(render, trace_);
  double sum = 0;
  for (const QuantisedComponent& c : components_) sum += ComponentScore(c, part, c.sample).log_likelihood();
  return sum;
}

JpegScore JpegImage::score(const Tensor<float>& render, const Tensor<float>& mark) const {
  check_fit("render", shape_, render);
  check_fit("mark", shape_, mark);
  const Tensor<float> part = from_first_block(render, trace_), part_mark = from_first_block(mark, trace_);
  JpegScore of_part{Tensor<float>(part.shape), Tensor<float>(part.shape)};
  for (const QuantisedComponent& c : components_)
    ComponentScore(c, part, c.on_object).add(part_mark, of_part);
  return {back_in_place(of_part.score, shape_, trace_), back_in_place(of_part.precision, shape_, trace_)};
}

}  // namespace fieldmark::watermark
