#include "mark_scale.h"

#include <cmath>
#include <limits>
#include <vector>

#include "support/catch.h"

using namespace fieldmark::watermark;

namespace {

// Seeks from scale 1 and counts the measurements.
struct Search {
  ScaledMark found;
  std::vector<double> scales;
};
template <class F>
Search seek(double target, F psnr) {
  Search s;
  s.found = seek_scale({.scale = 1, .psnr = psnr(1)}, target, 2, [&](double scale) {
    s.scales.push_back(scale);
    return psnr(scale);
  });
  return s;
}

double decibels(double power) { return -10 * std::log10(power); }

}  // namespace

TEST_CASE("mark_scale: a linear change takes one measurement") {
  const auto linear = [](double s) { return decibels(1e-4 * s * s); };
  for (const double target : {38.0, 41.5}) {
    const Search s = seek(target, linear);
    CHECK(s.scales.size() == 1);
    CHECK(is_near(s.found, target));
    CHECK(s.found.scale == Approx(std::pow(10.0, (40 - target) / 20)).epsilon(1e-12));
  }
  CHECK(seek(40.01, linear).scales.empty());
}

// A part of the change does not scale, or grows between scales 1 and 0.8.
TEST_CASE("mark_scale: power that hardly falls with the scale, or rises first, still ends near the target") {
  const auto floor = [](double s) { return decibels(0.4e-4 * s * s + 0.6e-4); };
  const auto bump = [](double s) {
    return decibels(1e-4 * (s * s + 0.4 * std::exp(-std::pow((s - 0.88) / 0.05, 2))));
  };
  CHECK(is_near(seek(41, floor).found, 41));
  REQUIRE(bump(0.89) < bump(1) - 0.5);
  CHECK(is_near(seek(41, bump).found, 41));
}

TEST_CASE(
    "mark_scale: it ends at its bounds where the target lies beyond, and keeps what it cannot measure") {
  const auto linear = [](double s) { return decibels(1e-4 * s * s); };
  CHECK(seek(20, linear).found.scale == 2);
  CHECK(seek(60, linear).found.scale == 0.5);
  const double infinity = std::numeric_limits<double>::infinity();
  const Search nothing = seek(40, [&](double) { return infinity; });
  CHECK(nothing.scales.empty());
  CHECK(nothing.found.scale == 1);
}
