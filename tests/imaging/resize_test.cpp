#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/resize.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {

double pixel(const Tensor<float>& x, Index y, Index column, Index c) {
  return static_cast<double>(x[(y * x.shape[1] + column) * x.shape[2] + c]);
}

// Enlarges both images to a common grid of H H' by W W' cells, where the mean over an output pixel is a plain
// sum of cells.
double area(const Tensor<float>& x, Index height, Index width, Index y, Index column, Index c) {
  const Index h = x.shape[0], w = x.shape[1];
  double sum = 0;
  for (Index a = y * h; a < (y + 1) * h; ++a)
    for (Index b = column * w; b < (column + 1) * w; ++b) sum += pixel(x, a / height, b / width, c);
  return sum / static_cast<double>(h * w);
}

double bilinear(const Tensor<float>& x, Index height, Index width, Index y, Index column, Index c) {
  auto at = [&](double v, double u) {
    auto inside = [](double t, Index n) {
      return static_cast<Index>(std::min(std::max(t, 0.0), double(n - 1)));
    };
    return pixel(x, inside(v, x.shape[0]), inside(u, x.shape[1]), c);
  };
  const double v = (double(y) + 0.5) * double(x.shape[0]) / double(height) - 0.5;
  const double u = (double(column) + 0.5) * double(x.shape[1]) / double(width) - 0.5;
  const double v0 = std::floor(v), u0 = std::floor(u), fv = v - v0, fu = u - u0;
  return (1 - fv) * ((1 - fu) * at(v0, u0) + fu * at(v0, u0 + 1)) +
         fv * ((1 - fu) * at(v0 + 1, u0) + fu * at(v0 + 1, u0 + 1));
}

// The kernel's two-dimensional weights over all pixels, divided by their sum.
template <class Kernel>
double filtered(const Kernel& f, const Tensor<float>& x, Index height, Index width, Index y, Index column,
                Index c) {
  const Index h = x.shape[0], w = x.shape[1];
  const double sy = double(h) / double(height), sx = double(w) / double(width);
  double sum = 0, weights = 0;
  for (Index a = 0; a < h; ++a)
    for (Index b = 0; b < w; ++b) {
      const double weight = f((double(a) + 0.5 - (double(y) + 0.5) * sy) / std::max(sy, 1.0)) *
                            f((double(b) + 0.5 - (double(column) + 0.5) * sx) / std::max(sx, 1.0));
      sum += weight * pixel(x, a, b, c);
      weights += weight;
    }
  return sum / weights;
}

double tent(double t) { return std::abs(t) < 1 ? 1 - std::abs(t) : 0; }
// Keys' two cubics, written out for a = -1/2.
double keys(double t) {
  const double u = std::abs(t);
  if (u < 1) return 1.5 * u * u * u - 2.5 * u * u + 1;
  return u < 2 ? -0.5 * u * u * u + 2.5 * u * u - 4 * u + 2 : 0;
}
double sinc(double t) { return t == 0 ? 1 : std::sin(3.141592653589793 * t) / (3.141592653589793 * t); }
double lanczos(double t) { return std::abs(t) < 3 ? sinc(t) * sinc(t / 3) : 0; }

template <class Resize, class Reference>
double worst_error(Resize resize, Reference reference) {
  double worst = 0;
  for (const Shape& s : {Shape{1, 1, 1}, Shape{5, 7, 3}, Shape{8, 1, 2}, Shape{16, 12, 4}})
    for (Index height : {1, 2, 5, 8, 13})
      for (Index width : {1, 3, 7, 12, 24}) {
        const auto x = uniform<float>(s, 0, 1, 1);
        const auto y = resize(x, height, width);
        if (y.shape != Shape{height, width, s[2]}) return 1e9;
        for (Index i = 0; i < y.size(); ++i) {
          const Index c = i % s[2], column = i / s[2] % width, row = i / s[2] / width;
          raise_to(worst, std::abs(static_cast<double>(y[i]) - reference(x, height, width, row, column, c)));
        }
      }
  return worst;
}

}  // namespace

TEST_CASE("resize: area equals the mean over a common grid, bilinear the four neighbours") {
  // Rounds numbers below 1 to float twice.
  CHECK(worst_error(resize_area, area) < 1.2e-7);
  CHECK(worst_error(resize_bilinear, bilinear) < 1.2e-7);
}

TEST_CASE("resize: kernels equal their sums over the whole image") {
  const auto with = [](ResizeFilter filter) {
    return [filter](const auto& x, Index h, Index w) { return resize_filtered(x, h, w, filter); };
  };
  const auto by = [](double (*f)(double)) {
    return [f](const auto&... rest) { return filtered(f, rest...); };
  };
  // Rounds to float twice; measured 5.7e-8, 7.3e-8 and 9.7e-8.
  CHECK(worst_error(with(ResizeFilter::bilinear), by(tent)) < 2e-7);
  CHECK(worst_error(with(ResizeFilter::bicubic), by(keys)) < 2e-7);
  CHECK(worst_error(with(ResizeFilter::lanczos), by(lanczos)) < 2e-7);
  CHECK(worst_error(with(ResizeFilter::nearest),
                    [](const auto& x, Index height, Index width, Index y, Index column, Index c) {
                      const auto under = [](Index i, Index in, Index out) {
                        return static_cast<Index>(std::floor((double(i) + 0.5) * double(in) / double(out)));
                      };
                      return pixel(x, under(y, x.shape[0], height), under(column, x.shape[1], width), c);
                    }) == 0);
  for (const auto filter :
       {ResizeFilter::nearest, ResizeFilter::bilinear, ResizeFilter::bicubic, ResizeFilter::lanczos}) {
    const auto x = uniform<float>({9, 11, 3}, 0, 1, 2);
    const auto y = resize_filtered(x, 9, 11, filter);
    for (Index i = 0; i < x.size(); ++i) CHECK(std::abs(y[i] - x[i]) < 1e-7f);
  }
  CHECK_THROWS_WITH(resize_filtered(Tensor<float>({2, 2, 3}), 1, 0, ResizeFilter::bicubic),
                    "[resize_filtered] height and width must be at least 1, got 1 and 0");
}

TEST_CASE("resize: the same size is the identity, a constant stays, a checkerboard halves to its mean") {
  const auto x = uniform<float>({9, 11, 3}, 0, 1, 2);
  CHECK(resize_area(x, 9, 11).data == x.data);
  CHECK(resize_bilinear(x, 9, 11).data == x.data);
  const Tensor<float> flat({7, 7, 1}, 0.3f);
  for (float v : resize_area(flat, 3, 5).data) CHECK(std::abs(v - 0.3f) < 6e-8f);
  Tensor<float> board({8, 8, 1});
  for (Index i = 0; i < 64; ++i) board[i] = static_cast<float>((i / 8 + i) % 2);
  for (float v : resize_area(board, 4, 4).data) CHECK(v == 0.5f);
}

TEST_CASE("resize: one pixel from millions is their mean") {
  const auto x = uniform<float>({2000, 1500, 1}, 0, 1, 3);
  double mean = 0;
  for (float v : x.data) mean += static_cast<double>(v) / 3e6;
  CHECK(std::abs(static_cast<double>(resize_area(x, 1, 1)[0]) - mean) < 6e-8);
}

TEST_CASE("resize: thread count and errors") {
  const auto x = uniform<float>({300, 200, 3}, 0, 1, 4);
  const ScopedThreads serial(1);
  const auto one = resize_area(x, 111, 333);
  const ScopedThreads parallel(2);
  CHECK(resize_area(x, 111, 333).data == one.data);
  CHECK_THROWS_WITH(resize_area(Tensor<float>({2, 2}), 1, 1),
                    Contains("[resize_area] image must have rank 3"));
  CHECK_THROWS_WITH(resize_bilinear(Tensor<float>({0, 2, 3}), 1, 1),
                    "[resize_bilinear] image: every extent must be at least 1, got shape [0, 2, 3]");
  CHECK_THROWS_WITH(resize_area(x, 0, 1), "[resize_area] height and width must be at least 1, got 0 and 1");
}
