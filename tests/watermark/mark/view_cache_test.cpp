#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/mark/view_cache.h>

#include <cmath>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
constexpr Index kWidth = 71, kHeight = 18;  // a row is several groups of rays and a rest

nerf::Camera view_camera() {
  return nerf::make_camera(nerf::look_at({2.2, -3.1, 1.7}, {0.1, 0.2, 0}, {0, 0, 1}), 0.9, kWidth, kHeight);
}

// Returns the field of the other tests with only one half filled, so that some rays see nothing.
nerf::RadianceField half_field() {
  nerf::RadianceField field = small_field();
  std::vector<std::uint8_t> keep(static_cast<std::size_t>(field.grid.cells()), 0);
  std::fill(keep.begin(), keep.begin() + static_cast<long>(keep.size()) / 2, std::uint8_t{1});
  field.grid.restrict_to(keep);
  return field;
}

CachedView view_of(const nerf::RadianceField& field) {
  nerf::Renderer renderer(field);
  return cache_view(renderer, field, view_camera());
}
}  // namespace

TEST_CASE("view_cache: base and opacity are the renderer's, and samples put the base together again") {
  const nerf::RadianceField field = half_field();
  const CachedView view = view_of(field);
  nerf::Renderer renderer(field);
  const nerf::Rendering want = renderer.render(view_camera());
  REQUIRE(view.base.shape == want.rgb.shape);
  REQUIRE(view.opacity.shape == want.opacity.shape);
  REQUIRE(view.sample_begin.size() == kWidth * kHeight + 1);
  double base = 0, opacity = 0, composed = 0;
  Index empty = 0, seen = 0;
  for (Index p = 0; p < kWidth * kHeight; ++p) {
    raise_to(opacity, std::abs(static_cast<double>(view.opacity[p] - want.opacity[p])));
    const auto k = static_cast<std::size_t>(view.sample_begin[static_cast<std::size_t>(p)]);
    const bool some = view.sample_begin[static_cast<std::size_t>(p) + 1] > static_cast<std::int32_t>(k);
    CHECK(some == (want.opacity[p] >= 0.02f));
    ++(some ? seen : empty);
    for (Index a = 0; a < 3; ++a) {
      raise_to(base, std::abs(static_cast<double>(view.base[3 * p + a] - want.rgb[3 * p + a])));
      if (!some) continue;
      const float w = view.weight[k], c = view.colour[3 * k + static_cast<std::size_t>(a)];
      raise_to(composed, std::abs(static_cast<double>(w * c + (1 - w) - view.base[3 * p + a])));
    }
  }
  CHECK(base < 1e-5);
  CHECK(opacity < 1e-5);
  CHECK(composed < 1e-5);
  CHECK(seen > 20);
  CHECK(empty > 20);
  CHECK(view.weight.size() == static_cast<std::size_t>(seen));
}

TEST_CASE("view_cache: a sample lies on its pixel's ray, inside the cube") {
  const nerf::RadianceField field = half_field();
  const CachedView view = view_of(field);
  double off = 0;
  for (Index p = 0; p < kWidth * kHeight; ++p) {
    const auto k = static_cast<std::size_t>(view.sample_begin[static_cast<std::size_t>(p)]);
    if (view.sample_begin[static_cast<std::size_t>(p) + 1] == static_cast<std::int32_t>(k)) continue;
    const nerf::Ray ray =
        nerf::pixel_ray(view_camera(), static_cast<double>(p % kWidth), static_cast<double>(p / kWidth));
    double to[3], along = 0, square = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double x = static_cast<double>(view.position[3 * k + a]);
      CHECK(x >= 0);
      CHECK(x <= 1);
      to[a] = x - (ray.origin[a] - field.space.bounds.corner[a]) / field.space.bounds.side;
      along += to[a] * ray.direction[a];
    }
    CHECK(along > 0);
    for (std::size_t a = 0; a < 3; ++a) square += std::pow(to[a] - along * ray.direction[a], 2);
    raise_to(off, std::sqrt(square));
  }
  CHECK(off < 1e-5);
}

TEST_CASE("view_cache: several samples of a ray are its heaviest parts, and few leave the pixel's weight") {
  const nerf::RadianceField field = half_field();
  nerf::Renderer renderer(field);
  const CachedView one = cache_view(renderer, field, view_camera()),
                   two = cache_view(renderer, field, view_camera(), 2),
                   all = cache_view(renderer, field, view_camera(), 1000);
  double worst = 0, composed = 0, moved = 0;
  Index more = 0;
  for (Index p = 0; p < kWidth * kHeight; ++p) {
    const auto share = [&](const CachedView& v) {
      double sum = 0;
      for (auto k = v.sample_begin[at(p)]; k < v.sample_begin[at(p + 1)]; ++k)
        sum += static_cast<double>(v.weight[at(k)]);
      return sum;
    };
    const auto count = [&](const CachedView& v) { return v.sample_begin[at(p + 1)] - v.sample_begin[at(p)]; };
    CHECK((count(one) == 0) == (count(all) == 0));
    CHECK(count(two) == std::min(2, count(all)));
    more += count(all) > 2;
    for (const CachedView* v : {&two, &all}) raise_to(worst, std::abs(share(*v) - share(one)));
    for (auto k = all.sample_begin[at(p)]; k + 1 < all.sample_begin[at(p + 1)]; ++k)
      CHECK(all.weight[at(k)] >= all.weight[at(k) + 1]);
    for (Index a = 0; a < 3 && count(all) > 0; ++a) {
      double c = 1 - share(all);
      for (auto k = all.sample_begin[at(p)]; k < all.sample_begin[at(p + 1)]; ++k)
        c += static_cast<double>(all.weight[at(k)] * all.colour[at(3 * k + a)]);
      raise_to(composed, std::abs(c - static_cast<double>(all.base[3 * p + a])));
      double mean = 0;
      for (auto k = all.sample_begin[at(p)]; k < all.sample_begin[at(p + 1)]; ++k)
        mean += static_cast<double>(all.weight[at(k)] * all.position[at(3 * k + a)]) / share(all);
      const auto only = 3 * Index{one.sample_begin[at(p)]} + a;
      raise_to(moved, std::abs(mean - static_cast<double>(one.position[at(only)])));
    }
  }
  CHECK(more > 20);
  CHECK(worst < 1e-5);
  CHECK(composed < 1e-5);
  CHECK(moved < 1e-5);
  CHECK_THROWS_WITH(cache_view(renderer, field, view_camera(), 0),
                    "[cache_view] samples must be at least 1, got 0");
}

TEST_CASE("view_cache: what lies together on a ray is one part, and parts lie apart") {
  const nerf::RadianceField field = half_field();
  nerf::Renderer fine(field, {.finer = 8}), coarse(field, {.finer = 2});
  const CachedView many = cache_view(fine, field, view_camera(), 1000),
                   few = cache_view(coarse, field, view_camera(), 1000);
  // Four times as many samples give 1.33 times as many parts (measured).
  CHECK(many.weight.size() < few.weight.size() * 3 / 2);
  Index pairs = 0;
  for (Index p = 0; p < kWidth * kHeight; ++p)
    for (auto k = many.sample_begin[static_cast<std::size_t>(p)];
         k < many.sample_begin[static_cast<std::size_t>(p) + 1]; ++k)
      for (auto l = many.sample_begin[static_cast<std::size_t>(p)]; l < k; ++l, ++pairs) {
        double square = 0;
        for (std::size_t a = 0; a < 3; ++a)
          square += std::pow(static_cast<double>(many.position[3 * static_cast<std::size_t>(k) + a] -
                                                 many.position[3 * static_cast<std::size_t>(l) + a]),
                             2);
        // The means of neighbouring runs of at most 1/128 are closest where one run ends and the next has
        // hardly begun.
        CHECK(std::sqrt(square) > 1.0 / 512);
      }
  CHECK(pairs > 20);
}

TEST_CASE("view_cache: one and two threads give the same bits") {
  const nerf::RadianceField field = half_field();
  const ScopedThreads serial(1);
  const CachedView one = view_of(field);
  const ScopedThreads parallel(2);
  const CachedView two = view_of(field);
  CHECK(one.base.data == two.base.data);
  CHECK(one.opacity.data == two.opacity.data);
  CHECK(one.sample_begin == two.sample_begin);
  CHECK(one.position == two.position);
  CHECK(one.colour == two.colour);
  CHECK(one.weight == two.weight);
}
