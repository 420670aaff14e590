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

TEST_CASE("depth_map: points at their depth lie on the built-in sphere, in a wide view too", "[render]") {
  const TemporaryFolder folder;
  const auto field = nerf::RadianceField::load(tiny_field(folder, tiny_scene(folder)));
  nerf::Renderer renderer(field);
  const auto ring = nerf::make_cameras(field.cameras, nerf::CameraSet::ring, 1, 24, 1).front();
  // Turned by 45 degrees, so that the sphere is at the side, where depth is not distance.
  nerf::Camera wide = nerf::make_camera(ring.pose, 2, 24, 24);
  for (std::size_t i = 0; i < 3; ++i) {
    const double right = ring.pose[4 * i], back = ring.pose[4 * i + 2];
    wide.pose[4 * i] = (right + back) / std::sqrt(2);
    wide.pose[4 * i + 2] = (back - right) / std::sqrt(2);
  }
  for (const nerf::Camera& camera : {ring, wide}) {
    const auto view = renderer.render(camera);
    const auto depth = depth_map(field, renderer, camera, view.opacity);
    REQUIRE(depth.shape == Shape{24, 24});
    Index seen = 0;
    double sum = 0;
    for (Index i = 0; i < 24 * 24; ++i) {
      CHECK(std::isnan(depth[i]) == (view.opacity[i] < 0.5f));
      if (std::isnan(depth[i])) continue;
      ++seen;
      const nerf::Ray ray = nerf::pixel_ray(camera, static_cast<double>(i % 24), static_cast<double>(i / 24));
      double cosine = 0, square = 0;
      for (std::size_t a = 0; a < 3; ++a) cosine += ray.direction[a] * camera.forward()[a];
      for (std::size_t a = 0; a < 3; ++a)
        square += std::pow(ray.origin[a] + static_cast<double>(depth[i]) / cosine * ray.direction[a], 2);
      sum += std::sqrt(square);
    }
    REQUIRE(seen >= 4);
    // The sphere's radius is 0.8, and means lie inside this soft field. Distances taken for depths give 1.6.
    CHECK(sum / static_cast<double>(seen) > 0.5);
    CHECK(sum / static_cast<double>(seen) < 0.8);
    const ScopedThreads one(1);
    const auto again = depth_map(field, renderer, camera, view.opacity);
    CHECK(std::memcmp(again.data.data(), depth.data.data(), depth.data.size() * sizeof(float)) == 0);
  }
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
