#include "fieldmark/distort/gradcheck_cases.h"

#include <array>
#include <cmath>
#include <utility>

#include "fieldmark/distort/affine_warp.h"
#include "fieldmark/distort/blur.h"
#include "fieldmark/distort/noise.h"
#include "fieldmark/distort/resize_area.h"
#include "fieldmark/distort/rotate.h"
#include "fieldmark/distort/similarity.h"

namespace fieldmark::distort {
namespace {

using Inputs = std::vector<Tensor<double>>;
using Vars = std::span<const Var<double>>;

constexpr std::array<double, 3> kBackground{0.9, 0.2, 0.6};
constexpr std::array<double, 24> kNormal{0.3,  -1.2, 0.7, 1.9, -0.4, 0.1, -2.2, 0.8,  0.5, -0.6, 1.1, -0.9,
                                         -1.5, 0.2,  0.4, 0.9, -0.1, 1.3, 0.6,  -0.7, 2.1, -1.0, 0.0, 0.5};
// Bilinear weights have kinks at integer positions. The warp cases stay 0.01 pixels away from them, further
// than the finite differences reach with this step, whose rounding error is about 1e-11.
constexpr double kSmallStep = 0.02;

Tensor<double> image(Shape shape) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i) t[i] = 0.5 + 0.5 * std::sin(1.0 + 2.7 * static_cast<double>(i));
  return t;
}

Tensor<double> vector(std::vector<double> v) {
  const auto n = static_cast<Index>(v.size());
  return {{n}, std::move(v)};
}

GradcheckCase make(const char* name, GradcheckFn f, Inputs inputs, double step = 1) {
  return {name, [f = std::move(f), inputs = std::move(inputs), step] {
            return gradcheck(f, inputs, {.step = step});
          }};
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases() {
  using D = Tape<double>;
  return {
      make("noise: x, mu, sigma", [](D&, Vars v) { return noise(v[0], v[1], v[2], kNormal); },
           {image({2, 4, 3}), vector({0.1}), vector({0.3})}),
      make("similarity: angle, scale, shift", [](D&, Vars v) { return similarity(v[0], v[1], v[2]); },
           {vector({0.7}), vector({1.3}), vector({2.5, -1.5})}),
      make(
          "affine_warp: x, matrix",
          [](D&, Vars v) {
            return affine_warp(v[0], v[1], {.height = 4, .width = 3, .background = kBackground});
          },
          {image({5, 6, 3}), vector({0.83, -0.31, 0.22, 0.27, 1.12, -0.36})}, kSmallStep),
      make(
          "affine_warp: grey", [](D&, Vars v) { return affine_warp(v[0], v[1]); },
          {image({4, 5, 1}), vector({1.07, 0.13, 0.31, -0.21, 0.91, 0.13})}, kSmallStep),
      make(
          "rotate: x, angle", [](D&, Vars v) { return rotate(v[0], v[1], kBackground); },
          {image({5, 4, 3}), vector({0.61})}, kSmallStep),
      make("resize_area: smaller", [](D&, Vars v) { return resize_area(v[0], 3, 4); }, {image({5, 7, 3})}),
      make("resize_area: larger", [](D&, Vars v) { return resize_area(v[0], 5, 4); }, {image({3, 3, 2})}),
      make("blur: x, sigma", [](D&, Vars v) { return blur(v[0], v[1]); }, {image({7, 6, 3}), vector({0.62})}),
      make("blur: wider than the image", [](D&, Vars v) { return blur(v[0], v[1]); },
           {image({2, 3, 2}), vector({1.87})}),
  };
}

}  // namespace fieldmark::distort
