#include "sampler.h"

#include <algorithm>
#include <cmath>

#include "small_field.h"
#include "some_rays.h"
#include "support/catch.h"
#include "support/each_isa.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
RaySamples sample(const RadianceField& f, const Rays& rays, const SamplingOptions& options,
                  std::span<const float> jitter = {}) {
  RaySampler sampler;
  RaySamples out;
  sampler.sample(f.field, f.params, f.grid, rays.batch(), jitter, options, out);
  return out;
}

// Walks one ray to its end without a field.
std::vector<float> walked(const RadianceField& f, const Rays& rays, Index r, float step, float jitter) {
  RayWalk walk(&rays.origins[static_cast<std::size_t>(3 * r)],
               &rays.directions[static_cast<std::size_t>(3 * r)], step, jitter);
  std::vector<float> t(10000), x(30000);
  t.resize(static_cast<std::size_t>(walk.next(f.grid, 10000, t.data(), x.data())));
  return t;
}

// Returns the density of each sample from the Field op, in double.
std::vector<double> densities(const RadianceField& f, const RaySamples& s) {
  ParamStore<double> store;
  const Field<double> field(store, f.options().field, 0);
  std::copy(f.params.values().begin(), f.params.values().end(), store.values().begin());
  const Tensor<double> x(Shape{s.size(), 3}, {s.position.begin(), s.position.end()});
  Tape<double> tape;
  const auto out = field(Params<double>(store, nullptr), tape.constant(x), tape.constant(x));
  return {out.sigma.value(), out.sigma.value() + s.size()};
}
}  // namespace

TEST_CASE("sampler: without a stop, all that a walk of each ray gives") {
  const RadianceField f = small_field();
  const Rays rays = some_rays(40);
  const auto jitter = uniform<float>({40}, 0, 1, 3);
  const RaySamples s = sample(f, rays, {.step = 0.01f, .stop = 0}, jitter.data);
  REQUIRE(s.ray_begin.size() == 41);
  CHECK(s.ray_begin[4] == s.ray_begin[3]);  // the ray misses
  for (Index r = 0; r < 40; ++r) {
    const auto begin = s.t.begin() + s.ray_begin[static_cast<std::size_t>(r)],
               end = s.t.begin() + s.ray_begin[static_cast<std::size_t>(r + 1)];
    CHECK(std::vector<float>(begin, end) == walked(f, rays, r, 0.01f, jitter[r]));
  }
}

TEST_CASE("sampler: densities equal the field's in double within 1e-4, on each instruction set") {
  const RadianceField f = small_field();
  const Rays rays = some_rays(20);
  each_isa([&] {
    const RaySamples s = sample(f, rays, {.step = 0.02f, .stop = 0});
    const auto want = densities(f, s);
    REQUIRE(s.size() > 500);
    double worst = 0;
    for (std::size_t i = 0; i < want.size(); ++i)
      raise_to(worst, std::abs(static_cast<double>(s.sigma[i]) / want[i] - 1));
    CHECK(worst < 1e-4);
  });
}

TEST_CASE("sampler: positions lie on the ray and features are the encoding's") {
  const RadianceField f = small_field();
  const Rays rays = some_rays(10);
  const RaySamples s = sample(f, rays, {.step = 0.03f, .stop = 0});
  const Index width = f.field.encoding().width();
  std::vector<float> density(static_cast<std::size_t>(s.size() * width)), colour(density.size());
  f.field.encoding().encode(f.params.values(f.field.encoding().table()), s.position.data(), s.size(),
                            density.data(), colour.data());
  CHECK(s.density_features == density);
  CHECK(s.colour_features == colour);
  for (std::size_t r = 0; r < 10; ++r)
    for (Index i = s.ray_begin[r]; i < s.ray_begin[r + 1]; ++i)
      for (std::size_t a = 0; a < 3; ++a) {
        const auto k = static_cast<std::size_t>(i);
        CHECK(std::abs(s.position[3 * k + a] -
                       (rays.origins[3 * r + a] + s.t[k] * rays.directions[3 * r + a])) < 1e-6f);
      }
}

TEST_CASE("sampler: a ray ends with the sample that makes it opaque") {
  RadianceField f = small_field();
  f.params.values(f.params.find("density/1/bias"))[0] += 4;  // dense matter
  const Rays rays = some_rays(40);
  const float stop = 0.01f;
  const RaySamples all = sample(f, rays, {.step = 0.01f, .stop = 0}),
                   cut = sample(f, rays, {.step = 0.01f, .stop = stop});
  CHECK(cut.size() < all.size() / 2);
  for (std::size_t r = 0; r < 40; ++r) {
    double depth = 0;
    Index want = 0;
    for (Index i = all.ray_begin[r];
         i < all.ray_begin[r + 1] && std::exp(-depth) >= static_cast<double>(stop); ++i) {
      depth += static_cast<double>(all.sigma[static_cast<std::size_t>(i)]) * static_cast<double>(0.01f);
      ++want;
    }
    const Index got = cut.ray_begin[r + 1] - cut.ray_begin[r];
    CHECK(got == want);
    CHECK(std::equal(cut.t.begin() + cut.ray_begin[r], cut.t.begin() + cut.ray_begin[r + 1],
                     all.t.begin() + all.ray_begin[r]));
  }
}

TEST_CASE("sampler: buffers reused from other rays leave no trace") {
  const RadianceField f = small_field();
  RaySampler sampler;
  RaySamples out;
  const Rays many = some_rays(50), few = some_rays(3), none;
  sampler.sample(f.field, f.params, f.grid, many.batch(), {}, {.step = 0.01f}, out);
  sampler.sample(f.field, f.params, f.grid, few.batch(), {}, {.step = 0.01f}, out);
  const RaySamples fresh = sample(f, few, {.step = 0.01f});
  CHECK(out.t == fresh.t);
  CHECK(out.sigma == fresh.sigma);
  CHECK(out.ray_begin == fresh.ray_begin);
  sampler.sample(f.field, f.params, f.grid, none.batch(), {}, {.step = 0.01f}, out);
  CHECK(out.ray_begin == std::vector<Index>{0});
  CHECK(out.size() == 0);
}

TEST_CASE("sampler: errors name argument and what came") {
  const RadianceField f = small_field();
  const Rays rays = some_rays(2);
  CHECK_THROWS_WITH(sample(f, rays, {.step = 0}), Contains("[sampler] step must be positive, got 0"));
  CHECK_THROWS_WITH(sample(f, rays, {}, std::vector<float>(3)),
                    "[sampler] jitter must have one element a ray (2), got 3");
  Rays odd = rays;
  odd.directions.pop_back();
  CHECK_THROWS_WITH(sample(f, odd, {}),
                    "[sampler] origins and directions must both be [R, 3], got 6 and 5 elements");
}
