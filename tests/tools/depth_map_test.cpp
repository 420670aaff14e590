#include "cli/depth_map.h"

#include <fieldmark/core/files.h>
#include <fieldmark/engine/parallel.h>

#include <cmath>
#include <cstring>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/tiny_job.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;
using namespace fieldmark::cli;

TEST_CASE("depth_map: points at their depth lie on the built-in sphere", "[render]") {
  const TemporaryFolder folder;
  const auto field = nerf::RadianceField::load(tiny_field(folder, tiny_scene(folder)));
  nerf::Renderer renderer(field);
  const nerf::Camera camera = nerf::make_cameras(field.cameras, nerf::CameraSet::ring, 1, 24, 1).front();
  const auto view = renderer.render(camera);
  const auto depth = depth_map(field, renderer, camera);
  REQUIRE(depth.shape == Shape{24, 24});
  Index seen = 0;
  double farthest = 0;
  for (Index i = 0; i < 24 * 24; ++i) {
    if (std::abs(view.opacity[i] - 0.5f) > 1e-3f) CHECK(std::isnan(depth[i]) == (view.opacity[i] < 0.5f));
    if (std::isnan(depth[i])) continue;
    ++seen;
    const nerf::Ray ray = nerf::pixel_ray(camera, static_cast<double>(i % 24), static_cast<double>(i / 24));
    double cosine = 0, radius = 0;
    for (std::size_t a = 0; a < 3; ++a) cosine += ray.direction[a] * camera.forward()[a];
    for (std::size_t a = 0; a < 3; ++a)
      radius += std::pow(ray.origin[a] + static_cast<double>(depth[i]) / cosine * ray.direction[a], 2);
    farthest = std::max(farthest, std::sqrt(radius));
    CHECK(depth[i] > 2.5f);  // the ring's distance is 4.03, the sphere's radius 1
    CHECK(depth[i] < 4.6f);
  }
  CHECK(seen > 40);
  CHECK(farthest < 1.5);
  const ScopedThreads one(1);
  const auto again = depth_map(field, renderer, camera);
  CHECK(std::memcmp(again.data.data(), depth.data.data(), depth.data.size() * sizeof(float)) == 0);
}

TEST_CASE("depth_map: an npy file has NumPy's header and the numbers", "[render]") {
  const TemporaryFolder folder;
  Tensor<float> values({2, 3});
  for (Index i = 0; i < 6; ++i) values[i] = static_cast<float>(i) / 4;
  write_npy(folder / "a.npy", values);
  const std::string bytes = read_text(folder / "a.npy");
  REQUIRE(bytes.size() == 128 + 24);
  CHECK(bytes.substr(0, 10) == std::string("\x93NUMPY\x01\x00\x76\x00", 10));
  CHECK(bytes.substr(10).starts_with("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, ), } "));
  CHECK(bytes[127] == '\n');
  CHECK(std::memcmp(bytes.data() + 128, values.data.data(), 24) == 0);
}
