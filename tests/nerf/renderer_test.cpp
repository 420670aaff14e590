#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/field_sampler.h>
#include <fieldmark/nerf/renderer.h>

#include <algorithm>
#include <cmath>

#include "small_field.h"
#include "support/bf16.h"
#include "support/catch.h"
#include "support/each_isa.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
Camera test_camera(Index width = 23, Index height = 18) {
  return make_camera(look_at({2.2, -3.1, 1.7}, {0.1, 0.2, 0}, {0, 0, 1}), 0.9, width, height);
}

// Renders by evaluating every pixel's samples one by one through the Field op in double, with nothing skipped
// or stopped.
struct ReferenceRenderer {
  ParamStore<double> store;
  Field<double> field;
  const RadianceField& f;
  explicit ReferenceRenderer(const RadianceField& rf) : field(store, rf.options().field, 0), f(rf) {
    std::copy(rf.params.values().begin(), rf.params.values().end(), store.values().begin());
  }

  // Returns red, green, blue and opacity of a ray, without the background.
  std::array<double, 4> trace(const Ray& ray) const {
    double o[3], near = 0, far = 1e9;
    for (std::size_t a = 0; a < 3; ++a) {
      o[a] = (ray.origin[a] - f.space.bounds.corner[a]) / f.space.bounds.side;
      const double t0 = -o[a] / ray.direction[a], t1 = (1 - o[a]) / ray.direction[a];
      near = std::max(near, std::min(t0, t1));
      far = std::min(far, std::max(t0, t1));
    }
    std::array<double, 4> out{};
    const auto step = static_cast<double>(f.step());
    double depth = 0;
    for (double t = near + step / 2; t < far; t += step) {
      const Tensor<double> x(Shape{1, 3}, {o[0] + t * ray.direction[0], o[1] + t * ray.direction[1],
                                           o[2] + t * ray.direction[2]});
      const Tensor<double> d(Shape{1, 3}, {ray.direction.begin(), ray.direction.end()});
      Tape<double> tape;
      const auto y = field(Params<double>(store, nullptr), tape.constant(x), tape.constant(d));
      const double w = -std::exp(-depth) * std::expm1(-y.sigma.value()[0] * step);
      for (std::size_t k = 0; k < 3; ++k) out[k] += w * y.rgb.value()[k];
      out[3] += w;
      depth += y.sigma.value()[0] * step;
    }
    return out;
  }
};

// Returns the largest difference of a rendering from the reference, over colour and opacity.
double worst_error(const RadianceField& f, const Rendering& view, const Camera& camera) {
  const ReferenceRenderer reference(f);
  const auto background = static_cast<double>(background_value(f.background));
  double worst = 0;
  for (Index y = 0; y < camera.height; ++y)
    for (Index x = 0; x < camera.width; ++x) {
      const auto want = reference.trace(pixel_ray(camera, static_cast<double>(x), static_cast<double>(y)));
      const Index pixel = y * camera.width + x;
      raise_to(worst, std::abs(static_cast<double>(view.opacity[pixel]) - want[3]));
      for (Index k = 0; k < 3; ++k)
        raise_to(worst, std::abs(static_cast<double>(view.rgb[3 * pixel + k]) -
                                 (want[static_cast<std::size_t>(k)] + (1 - want[3]) * background)));
    }
  return worst;
}
}  // namespace

TEST_CASE(
    "renderer: equal to dense sampling through the Field op in double, within 1e-4, each instruction set") {
  RadianceField f = small_field();
  const Camera camera = test_camera();
  for (const Background background : {Background::white, Background::black}) {
    f.background = background;
    each_isa([&] {
      Renderer renderer(f, {.finer = 1, .stop = 0, .least_weight = 0});
      CHECK(worst_error(f, renderer.render(camera), camera) < 1e-4);
    });
  }
}

TEST_CASE("renderer: a pixel of several rays is the mean of what they see, in double, within 1e-4") {
  const RadianceField f = small_field();
  const Camera camera = test_camera(9, 7);
  const ReferenceRenderer reference(f);
  constexpr Index kRays = 3;
  Renderer renderer(f, {.finer = 1, .stop = 0, .least_weight = 0, .supersampling = kRays});
  const Rendering view = renderer.render(camera);
  REQUIRE(view.rgb.shape == Shape{7, 9, 3});
  REQUIRE(view.opacity.shape == Shape{7, 9});
  double worst = 0;
  for (Index y = 0; y < camera.height; ++y)
    for (Index x = 0; x < camera.width; ++x) {
      std::array<double, 4> mean{};
      for (Index part = 0; part < kRays * kRays; ++part) {
        const auto seen = reference.trace(
            pixel_ray(camera, static_cast<double>(x) + static_cast<double>(part % kRays - 1) / 3,
                      static_cast<double>(y) + static_cast<double>(part / kRays - 1) / 3));
        for (std::size_t k = 0; k < 4; ++k) mean[k] += seen[k] / (kRays * kRays);
      }
      const Index pixel = y * camera.width + x;
      raise_to(worst, std::abs(static_cast<double>(view.opacity[pixel]) - mean[3]));
      for (Index k = 0; k < 3; ++k)
        raise_to(worst, std::abs(static_cast<double>(view.rgb[3 * pixel + k]) -
                                 (mean[static_cast<std::size_t>(k)] + (1 - mean[3]))));
    }
  CHECK(worst < 1e-4);
  CHECK_THROWS_WITH(Renderer(f, {.supersampling = -1}), "[renderer] supersampling must be 0 to 8, got -1");
  CHECK_THROWS_AS(Renderer(f, {.supersampling = 9}), ValueError);
}

TEST_CASE("renderer: what stopping and leaving out costs is below 0.01") {
  RadianceField f = small_field();
  f.params.values(f.params.find("density/1/bias"))[0] += 3;
  const Camera camera = test_camera();
  Renderer renderer(f, {.finer = 1});
  CHECK(worst_error(f, renderer.render(camera), camera) < 0.01);
}

TEST_CASE("renderer: bf16 shows the same image within its rounding") {
  const RadianceField f = small_field();
  const Camera camera = test_camera();
  Renderer plain(f);
  if (!bf16_or_skip("renderer: bf16")) {
    CHECK_THROWS_AS(Renderer(f, {.precision = Precision::bf16}), ValueError);
    return;
  }
  Renderer rounded(f, {.precision = Precision::bf16});
  const auto a = plain.render(camera).rgb.data, b = rounded.render(camera).rgb.data;
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) raise_to(worst, std::abs(a[i] - b[i]));
  CHECK(worst > 0);
  CHECK(worst < 0.01f);
}

TEST_CASE("renderer: an empty field is the background") {
  RadianceField f = small_field();
  f.grid.set_bits(std::vector<std::uint8_t>(static_cast<std::size_t>(f.grid.cells()), 0));
  Renderer renderer(f);
  const Rendering view = renderer.render(test_camera());
  CHECK(std::all_of(view.rgb.data.begin(), view.rgb.data.end(), [](float v) { return v == 1; }));
  CHECK(std::all_of(view.opacity.data.begin(), view.opacity.data.end(), [](float v) { return v == 0; }));
}

TEST_CASE("renderer: offsets displace the rays of pixels, and of their parts") {
  const RadianceField field = small_field();
  const Camera camera = test_camera();
  Camera moved = camera;
  moved.cx -= 0.25, moved.cy += 0.5;
  const PixelOffsets offsets(static_cast<std::size_t>(camera.width * camera.height), {0.25f, -0.5f});
  for (const Index rays : {1, 2}) {
    Renderer renderer(field, {.supersampling = rays});
    const Rendering seen = renderer.render(camera, &offsets), expected = renderer.render(moved);
    double most = 0, from_plain = 0;
    const Rendering plain = renderer.render(camera);
    for (std::size_t i = 0; i < seen.rgb.data.size(); ++i) {
      raise_to(most, std::abs(static_cast<double>(seen.rgb.data[i] - expected.rgb.data[i])));
      raise_to(from_plain, std::abs(static_cast<double>(seen.rgb.data[i] - plain.rgb.data[i])));
    }
    CHECK(most < 1e-4);
    CHECK(from_plain > 0.01);
    // Each pixel has its own: the left ones show their right neighbours, the others those above.
    PixelOffsets of_pixels(offsets.size());
    for (Index p = 0; p < 23 * 18; ++p)
      of_pixels[at(p)] = p % 23 < 11 ? std::array{1.f, 0.f} : std::array{0.f, p < 23 ? 0.f : -1.f};
    const Rendering own = renderer.render(camera, &of_pixels);
    most = 0;
    for (Index p = 0; p < 23 * 18; ++p) {
      const Index from = p % 23 < 11 ? p + 1 : p < 23 ? p : p - 23;
      for (Index k = 0; k < 3; ++k)
        raise_to(most, std::abs(static_cast<double>(own.rgb[3 * p + k] - plain.rgb[3 * from + k])));
    }
    CHECK(most < 1e-4);
  }
  Renderer renderer(field);
  const PixelOffsets few(3);
  CHECK_THROWS_WITH(renderer.render(camera, &few),
                    "[render] offsets must be of the camera's 414 pixels, got 3");
}

TEST_CASE("renderer: trace gives what render shows") {
  const RadianceField f = small_field();
  const Camera camera = test_camera(3, 2);
  Renderer renderer(f);
  const Rendering view = renderer.render(camera);
  const std::vector<float> pixels{0, 0, 1, 0, 2, 0, 0, 1, 1, 1, 2, 1};
  std::vector<float> out(24);
  CubeRays rays;
  rays.resize(6);
  rays.set(f.space, 0, camera, pixels);
  renderer.trace(rays.batch(f.space), 5, out.data());
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(out[4 * i + 3] == view.opacity.data[i]);
    for (std::size_t k = 0; k < 3; ++k)
      CHECK(out[4 * i + k] + (1 - out[4 * i + 3]) == view.rgb.data[3 * i + k]);
  }
}

TEST_CASE("renderer: finer steps come closer to the integral") {
  const RadianceField f = small_field();
  const Camera camera = test_camera();
  Renderer coarse(f, {.finer = 0.5f, .stop = 0, .least_weight = 0}),
      usual(f, {.finer = 2, .stop = 0, .least_weight = 0}),
      exact(f, {.finer = 32, .stop = 0, .least_weight = 0});
  const auto want = exact.render(camera).rgb.data;
  const auto worst = [&](Renderer& renderer) {
    const auto got = renderer.render(camera).rgb.data;
    double error = 0;
    for (std::size_t i = 0; i < want.size(); ++i) raise_to(error, std::abs(got[i] - want[i]));
    return error;
  };
  CHECK(worst(usual) < 0.7f * worst(coarse));
  CHECK_THROWS_WITH(Renderer(f, {.finer = 0}), "[renderer] finer must be positive, got 0");
}

TEST_CASE("renderer: follows changes of the field between views") {
  RadianceField f = small_field();
  Renderer renderer(f);
  const Camera camera = test_camera();
  const Rendering before = renderer.render(camera);
  for (float& v : f.params.values(f.params.find("colour/2/bias"))) v += 1;
  const Rendering after = renderer.render(camera);
  CHECK(before.opacity.data == after.opacity.data);
  CHECK(before.rgb.data != after.rgb.data);
}

TEST_CASE("renderer: recolouring replaces colours and leaves opacity alone") {
  const RadianceField f = small_field();
  const Camera camera = test_camera();
  Renderer renderer(f);
  const Rendering plain = renderer.render(camera);
  renderer.set_recolour([](const float*, const float*, Index n, float* rgb) {
    for (Index i = 0; i < n; ++i) rgb[3 * i] = 0.25f, rgb[3 * i + 1] = 1, rgb[3 * i + 2] = 0;
  });
  const Rendering painted = renderer.render(camera);
  CHECK(painted.opacity.data == plain.opacity.data);
  for (Index i = 0; i < plain.opacity.size(); ++i) {
    const float a = plain.opacity[i];
    CHECK(std::abs(painted.rgb[3 * i] - (1 - 0.75f * a)) < 1e-5f);
    CHECK(std::abs(painted.rgb[3 * i + 1] - 1) < 1e-5f);
    CHECK(std::abs(painted.rgb[3 * i + 2] - (1 - a)) < 1e-5f);
  }
  renderer.set_recolour({});
  CHECK(renderer.render(camera).rgb.data == plain.rgb.data);
}

TEST_CASE("renderer: the position of a ray is the mean of its samples by weight") {
  const RadianceField f = small_field();
  const Camera camera = test_camera(4, 1);
  Renderer renderer(f, {.finer = 1, .stop = 0, .least_weight = 0});
  const std::vector<float> pixels{0, 0, 1, 0, 2, 0, 3, 0};
  std::vector<float> out(20), position(15, 7.f);
  CubeRays rays;
  rays.resize(5);
  rays.set(f.space, 0, camera, pixels);
  rays.origins[12] = 9, rays.directions[12] = 1;  // misses everything
  renderer.trace(rays.batch(f.space), 0, out.data(), position.data());

  // With positions as colours, compositing gives the mean position times the opacity.
  renderer.set_recolour(
      [](const float* x, const float*, Index n, float* rgb) { std::copy_n(x, 3 * n, rgb); });
  renderer.trace(rays.batch(f.space), 0, out.data());
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t a = 0; a < 3; ++a) {
      const float mean = position[3 * r + a];
      CHECK(std::abs(mean * out[4 * r + 3] - out[4 * r + a]) < 1e-6f);
      CHECK((mean > 0 && mean < 1));
    }
  for (std::size_t a = 0; a < 3; ++a) CHECK(position[12 + a] == 0);

  // The samples themselves, near to far, add up to both.
  std::vector<SeenSample> seen{{.ray = 3}};
  renderer.set_recolour({});
  renderer.trace(rays.batch(f.space), 0, out.data());
  renderer.trace_samples(rays.batch(f.space), 0, seen);
  std::vector<double> sums(20), means(15), last(5, -1);
  CHECK(seen.size() > 8);
  for (const SeenSample& s : seen) {
    const auto r = static_cast<std::size_t>(s.ray);
    double along = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      sums[4 * r + a] += static_cast<double>(s.weight * s.colour[a]);
      means[3 * r + a] += static_cast<double>(s.weight * s.position[a]);
      along += static_cast<double>((s.position[a] - rays.origins[3 * r + a]) * rays.directions[3 * r + a]);
    }
    sums[4 * r + 3] += static_cast<double>(s.weight);
    CHECK(along > last[r]);
    last[r] = along;
  }
  for (std::size_t i = 0; i < 20; ++i) CHECK(std::abs(sums[i] - static_cast<double>(out[i])) < 1e-6);
  for (std::size_t i = 0; i < 12; ++i)
    CHECK(std::abs(means[i] - static_cast<double>(position[i]) * sums[4 * (i / 3) + 3]) < 1e-6);
}

TEST_CASE("renderer: sample weights are the composite's") {
  RaySamples samples;
  samples.ray_begin = {0, 0, 3, 4};
  samples.sigma = {1, 50, 2, 0.5f};
  samples.t.resize(4);
  float w[4];
  sample_weights(samples, 0.1f, w);
  const double want[] = {-std::expm1(-0.1), -std::exp(-0.1) * std::expm1(-5.0),
                         -std::exp(-5.1) * std::expm1(-0.2), -std::expm1(-0.05)};
  for (int i = 0; i < 4; ++i) CHECK(std::abs(static_cast<double>(w[i]) - want[i]) < 1e-7);
}

TEST_CASE("renderer: the same bits for one and two threads") {
  const RadianceField f = small_field();
  Renderer renderer(f);
  const Camera camera = test_camera(50, 37);
  const ScopedThreads serial(1);
  const Rendering one = renderer.render(camera);
  const ScopedThreads parallel(2);
  const Rendering two = renderer.render(camera);
  CHECK(one.rgb.data == two.rgb.data);
  CHECK(one.opacity.data == two.opacity.data);
}
