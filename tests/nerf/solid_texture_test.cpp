#include "solids.h"

#include <cmath>
#include <set>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
Vec3 random_point(unsigned seed) {
  const auto r = uniform({3}, -2, 2, seed);
  return {r[0], r[1], r[2]};
}
}  // namespace

TEST_CASE("solid_texture: every kind stays between its two colours and, but flat, uses both") {
  for (int kind = 0; kind <= static_cast<int>(TextureKind::marble); ++kind) {
    const SolidTexture t{
        .kind = static_cast<TextureKind>(kind), .a = {0, 1, 0.5}, .b = {1, 0, 0.5}, .scale = 0.3};
    double low = 1, high = 0;
    for (unsigned seed = 1; seed <= 400; ++seed) {
      const Vec3 c = texture_colour(t, random_point(seed));
      CHECK(std::abs(c[0] + c[1] - 1) < 1e-12);
      CHECK(std::abs(c[2] - 0.5) < 1e-12);
      CHECK((c[0] >= 0 && c[0] <= 1));
      low = std::min(low, c[0]), high = std::max(high, c[0]);
    }
    INFO("kind " << kind);
    CHECK(low < 0.1);
    CHECK((kind == 0 ? high == 0 : high > 0.9));
  }
}

TEST_CASE("solid_texture: checker changes from cell to cell") {
  const SolidTexture t{.kind = TextureKind::checker, .a = {0, 0, 0}, .b = {1, 1, 1}, .scale = 0.5};
  for (int k = -4; k < 4; ++k) {
    const double x = 0.25 * k + 0.1;
    CHECK(texture_colour(t, {x, 0.1, 0.1})[0] != texture_colour(t, {x + 0.25, 0.1, 0.1})[0]);
    CHECK(texture_colour(t, {0.1, x, 0.1})[0] == texture_colour(t, {0.1, x, 0.6})[0]);
  }
}

TEST_CASE("solid_texture: noise is continuous, differs by seed and covers its range evenly") {
  double sum = 0;
  std::set<double> values;
  for (unsigned seed = 1; seed <= 1000; ++seed) {
    const Vec3 p = random_point(seed);
    const double v = value_noise(p, 7);
    CHECK((v >= 0 && v < 1));
    CHECK(std::abs(value_noise({p[0] + 1e-6, p[1], p[2]}, 7) - v) < 2e-6);
    CHECK(value_noise(p, 8) != v);
    sum += value_noise({std::floor(p[0] * 1e4), std::floor(p[1] * 1e4), std::floor(p[2] * 1e4)}, 7);
    values.insert(v);
  }
  CHECK(std::abs(sum / 1000 - 0.5) < 0.04);  // standard deviation of the mean: sqrt(1/12/1000) = 0.009
  CHECK(values.size() == 1000);
}

TEST_CASE("solid_texture: noise far from the origin stays finite") {
  for (const double x : {1e9, -1e15, 1e300}) {
    const double v = value_noise({x, 0.5, -x}, 1);
    CHECK((v >= 0 && v < 1));
  }
}
