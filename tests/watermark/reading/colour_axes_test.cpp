#include "colour_axes.h"

#include <cmath>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

// Grey noise of power 1 and, in blue against yellow, a hundredth of it.
Tensor<float> mostly_grey(Index h, Index w) {
  Tensor<float> rest({h, w, 3});
  const auto grey = uniform<float>({h * w}, -1, 1, 1), blue = uniform<float>({h * w}, -0.1f, 0.1f, 2);
  for (Index p = 0; p < h * w; ++p) {
    rest[3 * p] = grey[p] - blue[p];
    rest[3 * p + 1] = grey[p] - blue[p];
    rest[3 * p + 2] = grey[p] + 2 * blue[p];
  }
  return rest;
}

double product(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return static_cast<double>(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

}  // namespace

TEST_CASE("colour_axes: the components of a residual are uncorrelated, and the axes orthonormal") {
  const Index h = 40, w = 50;
  Tensor<float> rest = mostly_grey(h, w);
  const ColourAxes axes =
      uncorrelated_axes(rest, Tensor<float>({h, w, 3}, 0.3f), std::vector<double>(h * w, 1));
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b) CHECK(std::abs(product(axes[a], axes[b]) - (a == b)) < 1e-6);
  turn(rest.data, axes);
  double both[3][3] = {};
  for (Index p = 0; p < h * w; ++p)
    for (Index a = 0; a < 3; ++a)
      for (Index b = 0; b < 3; ++b)
        both[a][b] += static_cast<double>(rest[3 * p + a] * rest[3 * p + b]) / (h * w);
  CHECK(std::abs(both[0][1]) < 1e-6);
  CHECK(std::abs(both[0][2]) < 1e-6);
  CHECK(std::abs(both[1][2]) < 1e-6);
  CHECK(both[2][2] == Approx(1.0).epsilon(0.05));        // grey: 3 x 1/3
  CHECK(both[1][1] == Approx(6.0 / 300).epsilon(0.05));  // blue against yellow: 6 x 0.01/3
  CHECK(both[0][0] < 1e-6);
}

TEST_CASE("colour_axes: only pixels that count decide, each as much as any other") {
  const Index h = 20, w = 20;
  Tensor<float> rest({h, w, 3}), power({h, w, 3});
  std::vector<double> on_object(h * w, 1);
  const auto noise = uniform<float>({h * w}, -1, 1, 3);
  for (Index p = 0; p < h * w; ++p) {
    const bool strong = p < 100;  // red, ten times as strong as green elsewhere
    rest[3 * p + (strong ? 0 : 1)] = (strong ? 10.f : 1.f) * noise[p];
    for (Index a = 0; a < 3; ++a) power[3 * p + a] = strong ? 100.f : 1.f;
  }
  CHECK(std::abs(uncorrelated_axes(rest, power, on_object)[2][1]) == Approx(1.0));  // green has more places
  std::fill(on_object.begin() + 100, on_object.end(), 0.0);
  CHECK(std::abs(uncorrelated_axes(rest, power, on_object)[2][0]) == Approx(1.0));
  std::fill(on_object.begin(), on_object.end(), 0.0);
  const ColourAxes none = uncorrelated_axes(rest, power, on_object);
  for (std::size_t a = 0; a < 3; ++a) CHECK(none[a][a] == 1);
}
