#include "field_reference.h"
#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>

#include <cmath>
#include <limits>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
nerf::Camera test_camera(Index width = 9, Index height = 7) {
  return nerf::make_camera(nerf::look_at({2.2, -3.1, 1.7}, {0.1, 0.2, 0}, {0, 0, 1}), 0.9, width, height);
}

// Evaluates the samples of one ray one after another through the Field op, in double.
struct BruteForce {
  ParamStore<double> store;
  nerf::Field<double> field;
  const nerf::RadianceField& f;
  explicit BruteForce(const nerf::RadianceField& rf) : field(store, rf.options().field, 0), f(rf) {
    std::copy(rf.params.values().begin(), rf.params.values().end(), store.values().begin());
  }
  bool matter(const double* x) const {
    const Index n = f.grid.resolution();
    Index c[3];
    for (int a = 0; a < 3; ++a)
      c[a] = std::min(static_cast<Index>(std::floor(x[a] * static_cast<double>(n))), n - 1);
    return f.grid.bits()[static_cast<std::size_t>(c[0] + n * (c[1] + n * c[2]))] != 0;
  }
  std::array<double, 4> trace(const nerf::Ray& ray, Index samples, bool occupancy) const {
    double o[3], near = 0, far = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < 3; ++a) {
      o[a] = (ray.origin[a] - f.space.bounds.corner[a]) / f.space.bounds.side;
      const double t0 = -o[a] / ray.direction[a], t1 = (1 - o[a]) / ray.direction[a];
      near = std::max(near, std::min(t0, t1));
      far = std::min(far, std::max(t0, t1));
    }
    std::array<double, 4> out{};
    double transmittance = 1;
    const double delta = (far - near) / static_cast<double>(samples);
    for (Index k = 0; near < far && k < samples; ++k) {
      const double t = near + (static_cast<double>(k) + 0.5) * delta;
      const Tensor<double> x(Shape{1, 3}, {o[0] + t * ray.direction[0], o[1] + t * ray.direction[1],
                                           o[2] + t * ray.direction[2]});
      if (occupancy && !matter(x.data.data())) continue;
      const Tensor<double> d(Shape{1, 3}, {ray.direction.begin(), ray.direction.end()});
      Tape<double> tape;
      const auto y = field(Params<double>(store, nullptr), tape.constant(x), tape.constant(d));
      const double w = transmittance * (1 - std::exp(-y.sigma.value()[0] * delta));
      for (std::size_t a = 0; a < 3; ++a) out[a] += w * y.rgb.value()[a];
      out[3] += w;
      transmittance -= w;
    }
    for (std::size_t a = 0; a < 3; ++a)
      out[a] += (1 - out[3]) * static_cast<double>(nerf::background_value(f.background));
    return out;
  }
};
}  // namespace

TEST_CASE(
    "field_reference: equal to a loop over samples in double within 1e-11, with occupancy and without") {
  nerf::RadianceField f = small_field();
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(f.grid.cells()));
  for (std::size_t c = 0; c < bits.size(); ++c) bits[c] = c % 3 != 0;
  f.grid.set_bits(bits);
  f.space.bounds = {.corner = {-1, -1.2, -0.9}, .side = 2.1};
  const BruteForce brute(f);
  const nerf::Camera camera = test_camera();
  for (const nerf::Background background : {nerf::Background::white, nerf::Background::black})
    for (const bool occupancy : {true, false}) {
      f.background = background;
      FieldReference reference(f, {.samples = 90, .occupancy = occupancy});
      const std::vector<double> got = reference.render(camera);
      REQUIRE(got.size() == static_cast<std::size_t>(4 * camera.width * camera.height));
      double worst = 0, opacity = 0;
      for (Index p = 0; p < camera.width * camera.height; ++p) {
        const auto want = brute.trace(nerf::pixel_ray(camera, static_cast<double>(p % camera.width),
                                                      static_cast<double>(p / camera.width)),
                                      90, occupancy);
        for (std::size_t a = 0; a < 4; ++a)
          raise_to(worst, std::abs(got[static_cast<std::size_t>(4 * p) + a] - want[a]));
        opacity = std::max(opacity, want[3]);
      }
      CHECK(worst < 1e-11);
      CHECK(opacity > 0.3);  // the ray hits something
    }
}

TEST_CASE("field_reference: some pixels are those of the whole, for any number of threads") {
  const nerf::RadianceField f = small_field();
  const nerf::Camera camera = test_camera(13, 11);
  FieldReference reference(f, {.samples = 40});
  const ScopedThreads serial(1);
  const std::vector<double> whole = reference.render(camera);
  const ScopedThreads parallel(2);
  const std::vector<Index> pixels{140, 3, 77, 3};
  const std::vector<double> some = reference.trace(camera, pixels);
  CHECK(reference.render(camera) == whole);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    for (std::size_t a = 0; a < 4; ++a)
      CHECK(some[4 * i + a] == whole[4 * static_cast<std::size_t>(pixels[i]) + a]);
}

TEST_CASE("field_reference: an empty field is the background, and what is not allowed") {
  nerf::RadianceField f = small_field();
  f.grid.set_bits(std::vector<std::uint8_t>(static_cast<std::size_t>(f.grid.cells()), 0));
  FieldReference reference(f, {.samples = 40});
  const std::vector<double> pixel = reference.trace(test_camera(), std::vector<Index>{30});
  CHECK(pixel == std::vector<double>{1, 1, 1, 0});
  CHECK(reference.trace(test_camera(), {}).empty());
  CHECK_THROWS_WITH(reference.trace(test_camera(), std::vector<Index>{63}),
                    "[field_reference] pixels must lie in the image of 63, got 63");
  CHECK_THROWS_AS(reference.trace(test_camera(), std::vector<Index>{-1}), ValueError);
  CHECK_THROWS_WITH(FieldReference(f, {.samples = 0}), "[field_reference] samples must be at least 1, got 0");
}
