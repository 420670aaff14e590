#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/resize.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace fieldmark {
namespace {

/// The input samples and weights of an output pixel along one axis.
struct Taps {
  Index first = 0;
  std::vector<double> weights;
};
using MakeTaps = Taps (*)(Index i, Index in, Index out);

Taps area_taps(Index i, Index in, Index out) {
  // In units of 1 / out the output pixel covers [i in, (i + 1) in) and input pixel k covers [k out, (k + 1)
  // out): integers, so that the weights are exact.
  const Index begin = i * in, end = begin + in;
  Taps t{.first = begin / out, .weights = {}};
  for (Index k = t.first; k * out < end; ++k) {
    const Index overlap = std::min(end, (k + 1) * out) - std::max(begin, k * out);
    t.weights.push_back(static_cast<double>(overlap) / static_cast<double>(in));
  }
  return t;
}

Taps linear_taps(Index i, Index in, Index out) {
  const double x = (static_cast<double>(i) + 0.5) * static_cast<double>(in) / static_cast<double>(out) - 0.5;
  const double c = std::clamp(x, 0.0, static_cast<double>(in - 1));
  const Index first = std::min(static_cast<Index>(c), std::max<Index>(in - 2, 0));
  const double f = c - static_cast<double>(first);
  if (in == 1) return {.first = 0, .weights = {1.0}};
  return {.first = first, .weights = {1 - f, f}};
}

Taps nearest_taps(Index i, Index in, Index out) {
  return {.first = (2 * i + 1) * in / (2 * out), .weights = {1.0}};
}

double triangle(double x) { return std::max(0.0, 1 - std::abs(x)); }
double cubic(double x) {
  const double a = -0.5, t = std::abs(x);
  if (t < 1) return ((a + 2) * t - (a + 3)) * t * t + 1;
  return t < 2 ? (((t - 5) * t + 8) * t - 4) * a : 0;
}
double lanczos3(double x) {
  if (x == 0) return 1;
  const double p = std::numbers::pi * x;
  return std::abs(x) < 3 ? 3 * std::sin(p) * std::sin(p / 3) / (p * p) : 0;
}

template <double (*kernel)(double), int half_width>
Taps kernel_taps(Index i, Index in, Index out) {
  const double s = static_cast<double>(in) / static_cast<double>(out), stretch = std::max(s, 1.0);
  const double centre = (static_cast<double>(i) + 0.5) * s, reach = half_width * stretch;
  const auto first = std::max<Index>(0, static_cast<Index>(std::floor(centre - reach + 0.5)));
  const auto end = std::min(in, static_cast<Index>(std::floor(centre + reach + 0.5)));
  Taps t{.first = first, .weights = {}};
  double sum = 0;
  for (Index k = first; k < end; ++k) {
    t.weights.push_back(kernel((static_cast<double>(k) + 0.5 - centre) / stretch));
    sum += t.weights.back();
  }
  for (double& w : t.weights) w /= sum;
  return t;
}

// Resizes [outer, in, inner] to [outer, out, inner]; sums in double.
Tensor<float> along(const Tensor<float>& x, Index outer, Index in, Index out, Index inner, MakeTaps make,
                    Shape shape) {
  std::vector<Taps> taps;
  for (Index i = 0; i < out; ++i) taps.push_back(make(i, in, out));
  Tensor<float> y(shape);
  parallel_for(outer * out, std::max<Index>(1, 4096 / inner), [&](Index begin, Index end) {
    std::vector<double> sum(static_cast<std::size_t>(inner));
    for (Index o = begin; o < end; ++o) {
      const Taps& t = taps[static_cast<std::size_t>(o % out)];
      const float* from = x.data.data() + (o / out * in + t.first) * inner;
      std::fill(sum.begin(), sum.end(), 0.0);
      for (double w : t.weights) {
        for (Index c = 0; c < inner; ++c)
          sum[static_cast<std::size_t>(c)] += w * static_cast<double>(from[c]);
        from += inner;
      }
      std::transform(sum.begin(), sum.end(), y.data.begin() + o * inner,
                     [](double s) { return static_cast<float>(s); });
    }
  });
  return y;
}

Tensor<float> resize(const char* op, const Tensor<float>& image, Index height, Index width, MakeTaps make) {
  const Shape& s = image.shape;
  check_rank(op, "image", s, 3, "[height, width, channels]");
  if (s[0] < 1 || s[1] < 1 || s[2] < 1)
    throw ShapeError("[" + std::string(op) + "] image: every extent must be at least 1, got shape " +
                     s.str());
  if (height < 1 || width < 1)
    throw ValueError("[" + std::string(op) + "] height and width must be at least 1, got " +
                     std::to_string(height) + " and " + std::to_string(width));
  const Tensor<float> rows = along(image, 1, s[0], height, s[1] * s[2], make, {height, s[1], s[2]});
  return along(rows, height, s[1], width, s[2], make, {height, width, s[2]});
}

}  // namespace

Tensor<float> resize_area(const Tensor<float>& image, Index height, Index width) {
  return resize("resize_area", image, height, width, area_taps);
}

Tensor<float> resize_bilinear(const Tensor<float>& image, Index height, Index width) {
  return resize("resize_bilinear", image, height, width, linear_taps);
}

Tensor<float> resize_filtered(const Tensor<float>& image, Index height, Index width, ResizeFilter filter) {
  MakeTaps make = nearest_taps;
  if (filter == ResizeFilter::bilinear) make = kernel_taps<triangle, 1>;
  if (filter == ResizeFilter::bicubic) make = kernel_taps<cubic, 2>;
  if (filter == ResizeFilter::lanczos) make = kernel_taps<lanczos3, 3>;
  return resize("resize_filtered", image, height, width, make);
}

}  // namespace fieldmark
