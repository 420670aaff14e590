#include "fixed_carriers.h"

#include <fieldmark/core/error.h>

#include <cmath>
#include <set>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
std::vector<float> message(Index bits, float value) { return std::vector<float>(at(bits), value); }
}  // namespace

TEST_CASE("fixed_carriers: every bit has three cells or more, and equal seeds deal them equally") {
  const FixedCarriers carriers(tiny_views(), 4, 1), same(tiny_views(), 4, 1), other(tiny_views(), 4, 2);
  CHECK(carriers.cells() >= 12);
  std::set<std::int32_t> bits;
  bool differs = false;
  for (const CachedView& v : tiny_views())
    for (std::size_t k = 0; k < v.weight.size(); ++k) {
      const float* x = &v.position[3 * k];
      const auto carried = carriers.carried(x);
      bits.insert(carried.bit);
      CHECK(carried.bit == same.carried(x).bit);
      differs = differs || carried.bit != other.carried(x).bit;
    }
  bits.erase(-1);
  CHECK(bits == std::set<std::int32_t>{0, 1, 2, 3});
  CHECK(differs);
}

TEST_CASE(
    "fixed_carriers: a mark has the root mean square of 21 dB, and each value of a bit a look of its own") {
  const FixedCarriers carriers(tiny_views(), 4, 1);
  const CachedView& v = tiny_views().front();
  const Index n = std::ssize(v.weight);
  const std::vector<float> grey(at(3 * n), 0.5f);  // nothing clips
  std::vector<float> ones(grey), minus(grey);
  carriers.mark(message(4, 1), v.position.data(), grey.data(), n, ones.data());
  carriers.mark(message(4, -1), v.position.data(), grey.data(), n, minus.data());
  double power = 0, shown = 0, difference = 0;
  for (Index i = 0; i < n; ++i) {
    if (carriers.carried(&v.position[at(3 * i)]).bit < 0) continue;
    shown += 3;
    for (Index k = 3 * i; k < 3 * i + 3; ++k) {
      power += std::pow(ones[at(k)] - grey[at(k)], 2);
      difference += std::pow(ones[at(k)] - minus[at(k)], 2);
    }
  }
  CHECK(-10 * std::log10(power / shown) == Approx(21).margin(1.5));
  CHECK(difference > 1.2 * power);  // two colour axes at least 60 degrees apart
}

TEST_CASE("fixed_carriers: the image of a view is its base plus the change of its samples") {
  const FixedCarriers carriers(tiny_views(), 4, 1);
  const CachedView& v = tiny_views()[1];
  std::vector<float> image(at(v.base.size())), colour(v.colour);
  carriers.mark(message(4, 1), v, image.data());
  carriers.mark(message(4, 1), v.position.data(), v.colour.data(), std::ssize(v.weight), colour.data());
  for (Index p = 0; p < v.height * v.width; ++p) {
    const Index k = v.sample_begin[at(p)];
    const bool seen = k != v.sample_begin[at(p + 1)];
    for (Index a = 0; a < 3; ++a) {
      const float change = seen ? v.weight[at(k)] * (colour[at(3 * k + a)] - v.colour[at(3 * k + a)]) : 0.f;
      CHECK(image[at(3 * p + a)] == Approx(std::clamp(v.base[3 * p + a] + change, 0.f, 1.f)).margin(1e-6));
    }
  }
  CHECK_THROWS_AS(FixedCarriers({}, 4, 1), ValueError);
}
