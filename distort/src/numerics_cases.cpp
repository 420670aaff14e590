#include "fieldmark/distort/numerics_cases.h"

#include <algorithm>
#include <numbers>

#include "fieldmark/distort/affine_warp.h"
#include "fieldmark/distort/blur.h"
#include "fieldmark/distort/distortion.h"
#include "fieldmark/distort/resize_area.h"
#include "fieldmark/distort/rotate.h"

namespace fieldmark::distort {
namespace {

using Real = long double;

template <class T, class F>
Tensor<T> result(const F& op, const Tensor<T>& x, double parameter) {
  Tape<T> tape;
  const Tensor<T> p({1}, static_cast<T>(parameter));
  const Var<T> y = op(tape.constant(x), tape.constant(p));
  return {y.shape(), std::vector<T>(y.value(), y.value() + y.shape().size())};
}

template <class T>
void expect_bits(const Tensor<T>& got, const Tensor<T>& want, WorstError& error) {
  error.equal(got.size(), want.size());
  for (Index i = 0; i < std::min(got.size(), want.size()); ++i) error.equal(got[i], want[i]);
}

// Quarter turns of square images must permute the pixels.
template <class T>
void compare_rotations(WorstError& error) {
  const auto turn = [](auto x, auto a) { return rotate(x, a); };
  for (const Index n : {1, 4, 7, 40}) {
    const auto x = scattered<T>({n, n, 3}, 0, 1, 1);
    for (int quarter = -2; quarter <= 2; ++quarter) {
      const auto y = result(turn, x, quarter * std::numbers::pi / 2);
      for (Index i = 0; i < n; ++i)
        for (Index j = 0; j < n; ++j)
          for (Index c = 0; c < 3; ++c) {
            const Index m = n - 1, r = quarter == 0 ? i : quarter == 1 ? j : quarter == -1 ? m - j : m - i;
            const Index q = quarter == 0 ? j : quarter == 1 ? m - i : quarter == -1 ? i : m - j;
            error.equal(y[(i * n + j) * 3 + c], x[(r * n + q) * 3 + c]);
          }
    }
  }
}

template <class T>
void compare_identities(WorstError& error) {
  for (const Shape s : {Shape{1, 1, 3}, Shape{5, 8, 3}, Shape{40, 31, 1}}) {
    const auto x = scattered<T>(s, 0, 1, 1);
    expect_bits(result([&](auto v, auto) { return resize_area(v, s[0], s[1]); }, x, 0), x, error);
    for (const double sigma : {0.0, 1e-30, 1e-6, 1e-2})
      expect_bits(result([](auto v, auto a) { return blur(v, a); }, x, sigma), x, error);
  }
}

// Distortions that must not change an 8-bit image.
void compare_distortions(WorstError& error) {
  auto x = scattered<float>({24, 31, 3}, 0, 255, 1);
  for (float& v : x.data) v = std::round(v) / 255;
  const std::vector<float> background{1, 0, 1};
  for (const char* name : {"crop_1", "rotation_0", "scale_1", "blur_0", "noise_0", "gamma_1", "brightness_1",
                           "hue_0", "hue_360"})
    expect_bits(apply_distortion(parse_distortion(name), x, CounterRng(7), 0, background), x, error);
}

// Positions far outside and non-finite ones read the background.
template <class T>
void compare_far_warps(WorstError& error) {
  const std::vector<T> background{T(0.25)};
  const Tensor<T> x({2, 2, 1}, T(7)), want({2, 2, 1}, T(0.25));
  for (const double bad : {std::nan(""), 1e38, -1e38, std::numeric_limits<double>::infinity()})
    for (Index k = 0; k < 6; ++k) {
      Tensor<T> matrix({6}, {1, 0, 0, 0, 1, 0});
      matrix[k] = static_cast<T>(bad);
      Tape<T> tape;
      const Var<T> y = affine_warp(tape.constant(x), tape.constant(matrix), {.background = background});
      for (Index i = 0; i < 4; ++i) error.equal(y.value()[i], want[i]);
    }
}

// Compares with the two-dimensional sum, relative to 1, the largest value.
template <class T>
void compare_blur(double sigma, WorstError& error) {
  const Index h = 33, w = 20;
  const auto x = scattered<T>({h, w, 1}, 0, 1, 1);
  const auto y = result([](auto v, auto a) { return blur(v, a); }, x, sigma);
  const auto s = static_cast<Real>(static_cast<T>(sigma));
  const auto r = std::max<Index>(1, static_cast<Index>(std::ceil(4 * s)));
  const auto weight = [&](Index k) { return std::exp(-static_cast<Real>(k * k) / (2 * s * s)); };
  Real total = 0;
  for (Index k = -r; k <= r; ++k) total += weight(k);
  Tensor<Real> rows({h, w, 1});
  for (Index i = 0; i < h * w; ++i)
    for (Index k = -r; k <= r; ++k)
      rows[i] += weight(k) / total * x[i / w * w + std::clamp<Index>(i % w + k, 0, w - 1)];
  for (Index i = 0; i < h * w; ++i) {
    Real sum = 0;
    for (Index k = -r; k <= r; ++k)
      sum += weight(k) / total * rows[std::clamp<Index>(i / w + k, 0, h - 1) * w + i % w];
    error.compare(y[i], sum, 1);
  }
}

}  // namespace

std::vector<NumericsCase> numerics_cases() {
  std::vector<NumericsCase> all;
  add_numerics(all, "rotate: 0, +-90 and +-180 degrees permute pixels", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_rotations<decltype(t)>(e); });
  add_numerics(all, "resize_area, blur: the same size and sigma to 0 change nothing", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_identities<decltype(t)>(e); });
  all.push_back({"distortion: crop of the whole image, and all without effect", "float", "bits", 0, [] {
                   WorstError e;
                   compare_distortions(e);
                   return e;
                 }});
  add_numerics(all, "affine_warp: huge and undefined matrices", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_far_warps<decltype(t)>(e); });
  for (const double sigma : {0.3, 2.6, 20.0}) {
    char name[40];
    std::snprintf(name, sizeof name, "blur: sigma %g", sigma);
    add_numerics(all, name, "1", 6e-7, 3e-15,
                 [=](auto t, WorstError& e) { compare_blur<decltype(t)>(sigma, e); });
  }
  return all;
}

}  // namespace fieldmark::distort
