#include <fieldmark/nerf/composite.h>
#include <fieldmark/nerf/field_sampler.h>
#include <fieldmark/nerf/renderer.h>

#include <algorithm>
#include <cmath>

#include "sampler.h"
#include "small_field.h"
#include "some_rays.h"
#include "support/catch.h"
#include "support/each_isa.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
// Returns networks with weights large enough to matter.
RadianceField small_mlp(double log_density) {
  RadianceField f(small_mlp_options());
  const auto numbers = uniform<float>({f.params.size()}, -0.5, 0.5, 3);
  std::copy(numbers.data.begin(), numbers.data.end(), f.params.values().begin());
  for (const char* name : {"density/3/bias", "coarse/density/3/bias"})
    f.params.values(f.params.find(name))[0] = static_cast<float>(log_density);
  return f;
}

RaySamples sample(const RadianceField& f, const Rays& rays, const FieldSamplingOptions& options,
                  std::span<const float> jitter = {}) {
  FieldSampler sampler;
  RaySamples out;
  sampler.sample(f, rays.batch(), jitter, options, out);
  return out;
}

// Density and colour at positions from the Field op, in double.
struct Seen {
  std::vector<double> sigma, rgb;
};
Seen look(const RadianceField& f, const std::vector<float>& position, const std::vector<double>& direction) {
  ParamStore<double> store;
  const Field<double> field(store, f.options().field, 0);
  const Field<double> coarse(store, f.options().field, 0, "coarse/");
  std::copy(f.params.values().begin(), f.params.values().end(), store.values().begin());
  const Index n = std::ssize(position) / 3;
  const Tensor<double> x({n, 3}, {position.begin(), position.end()});
  Tape<double> tape;
  const auto out =
      field(Params<double>(store, nullptr), tape.constant(x), tape.constant(direction.data(), {n, 3}));
  return {{out.sigma.value(), out.sigma.value() + n}, {out.rgb.value(), out.rgb.value() + 3 * n}};
}

std::vector<double> directions_of(const Rays& rays, const RaySamples& s) {
  std::vector<double> d;
  for (std::size_t r = 0; r + 1 < s.ray_begin.size(); ++r)
    for (Index i = s.ray_begin[r]; i < s.ray_begin[r + 1]; ++i)
      for (std::size_t a = 0; a < 3; ++a) d.push_back(static_cast<double>(rays.directions[3 * r + a]));
  return d;
}
}  // namespace

TEST_CASE(
    "field_sampler: densities of an mlp field equal those in double within 1e-4, on each instruction set") {
  const RadianceField f = small_mlp(1);
  const Rays rays = some_rays(40, false);
  each_isa([&] {
    const RaySamples s = sample(f, rays, {.stop = 0, .points = {.average = 20, .importance = 12}});
    REQUIRE(s.size() == 40 * 32);
    CHECK(s.z.size() == static_cast<std::size_t>(s.size() * 17));
    const Seen want = look(f, s.position, directions_of(rays, s));
    double worst = 0;
    for (std::size_t i = 0; i < want.sigma.size(); ++i)
      raise_to(worst, std::abs(static_cast<double>(s.sigma[i]) / want.sigma[i] - 1));
    CHECK(worst < 1e-4);
  });
}

TEST_CASE("field_sampler: a ray of an mlp field ends with the sample that makes it opaque") {
  const RadianceField f = small_mlp(4);
  const Rays rays = some_rays(60, false);
  const RayPoints points{.average = 40, .importance = 24};
  const float stop = 0.01f;
  const RaySamples all = sample(f, rays, {.stop = 0, .points = points}),
                   cut = sample(f, rays, {.stop = stop, .points = points});
  CHECK(cut.size() < all.size() * 3 / 4);
  for (std::size_t r = 0; r < 60; ++r) {
    double depth = 0;
    Index want = 0;
    for (Index i = all.ray_begin[r];
         i < all.ray_begin[r + 1] && std::exp(-depth) >= static_cast<double>(stop); ++i, ++want)
      depth += static_cast<double>(all.sigma[static_cast<std::size_t>(i)]) *
               static_cast<double>(all.delta[static_cast<std::size_t>(i)]);
    const Index begin = cut.ray_begin[r], n = cut.ray_begin[r + 1] - begin;
    CHECK(n == want);
    const auto same = [&](const std::vector<float>& a, const std::vector<float>& b, Index columns) {
      return std::equal(a.begin() + begin * columns, a.begin() + (begin + n) * columns,
                        b.begin() + all.ray_begin[r] * columns);
    };
    CHECK(same(cut.t, all.t, 1));
    CHECK(same(cut.position, all.position, 3));
    CHECK(same(cut.delta, all.delta, 1));
  }
}

TEST_CASE("field_sampler: importance points of an mlp field come from the coarse network") {
  RadianceField f = small_mlp(2);
  const Rays rays = some_rays(10, false);
  const FieldSamplingOptions options{.stop = 0, .points = {.average = 8, .importance = 8}};
  const RaySamples before = sample(f, rays, options);
  for (const auto& e : f.params.entries())
    if (e.name.starts_with("coarse/density/2"))
      for (float& v : f.params.values(f.params.find(e.name))) v *= -3;
  CHECK(sample(f, rays, options).t != before.t);
  const FieldSamplingOptions average{.stop = 0, .points = {.average = 16, .importance = 0}};
  const RaySamples even = sample(f, rays, average);
  for (float& v : f.params.values(f.params.find("coarse/density/2/weight"))) v *= -3;
  CHECK(sample(f, rays, average).t == even.t);
}

TEST_CASE("field_sampler: an image of an mlp field is the quadrature in double, within 1e-4") {
  const RadianceField f = small_mlp(2);
  const Rays rays = some_rays(150, false);  // three blocks
  for (const RayPoints points : {RayPoints{.average = 32, .importance = 32},
                                 {.average = 64, .importance = 0},
                                 {.average = 0, .importance = 0, .random = 64}}) {
    Renderer renderer(f, {.stop = 0, .least_weight = 0, .points = points});
    std::vector<float> got(600);
    renderer.trace(rays.batch(), 0, got.data());
    const RaySamples s = sample(f, rays, {.stop = 0, .points = points});
    const Seen seen = look(f, s.position, directions_of(rays, s));
    const Tensor<double> delta({s.size()}, {s.delta.begin(), s.delta.end()});
    Tape<double> tape;
    const auto want =
        composite(tape.constant(seen.sigma.data(), {s.size()}), tape.constant(seen.rgb.data(), {s.size(), 3}),
                  tape.constant(delta), std::span<const Index>(s.ray_begin));
    double worst = 0;
    for (Index i = 0; i < 600; ++i)
      raise_to(worst, std::abs(static_cast<double>(got[static_cast<std::size_t>(i)]) - want.value()[i]));
    CHECK(worst < 1e-4);
  }
}

TEST_CASE(
    "field_sampler: a field with a table is marched, and buffers used by the other kind leave no trace") {
  const RadianceField hash = small_field(), mlp = small_mlp(1);
  const Rays rays = some_rays(20, false);
  FieldSampler sampler;
  RaySamples out, want;
  sampler.sample(mlp, rays.batch(), {}, {.stop = 0, .points = {.average = 4, .importance = 4}}, out);
  sampler.sample(hash, rays.batch(), {}, {.stop = 0}, out);
  RaySampler march;
  march.sample(hash.field, hash.params, hash.grid, rays.batch(), {}, {.step = hash.step(), .stop = 0}, want);
  CHECK(out.t == want.t);
  CHECK(out.sigma == want.sigma);
  CHECK(out.delta.empty());
  CHECK(out.z.empty());
}

TEST_CASE("field_sampler: weights of samples with and without their own spacing") {
  RaySamples s;
  s.ray_begin = {0, 2};
  s.t = {0.1f, 0.2f};
  s.sigma = {1, 2};
  float w[2];
  sample_weights(s, 0.5f, w);
  CHECK(std::abs(static_cast<double>(w[0]) + std::expm1(-0.5)) < 1e-7);
  s.delta = {0.25f, 0.5f};
  sample_weights(s, 99, w);
  CHECK(std::abs(static_cast<double>(w[0]) + std::expm1(-0.25)) < 1e-7);
  CHECK(std::abs(static_cast<double>(w[1]) + std::exp(-0.25) * std::expm1(-1.0)) < 1e-7);
}
