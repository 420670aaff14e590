#include "distorting_lens.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("distorting_lens: the fisheye is equidistant, and both lenses are inverted") {
  const DistortingLens fisheye = DistortingLens::equidistant(), rational = DistortingLens::rational();
  CHECK(fisheye.distorted(1) == std::atan(1.0));
  CHECK(rational.distorted(0.5) < 0.5);
  for (const DistortingLens& lens : {fisheye, rational})
    for (double r = 0; r < 0.9; r += 0.05) CHECK(std::abs(lens.undistorted(lens.distorted(r)) - r) < 1e-9);
  const auto keys = nlohmann::json::parse(rational.keys());
  CHECK(keys["camera_model"] == "FULL_OPENCV");
  CHECK(keys["k6"].get<double>() != 0);
  CHECK(nlohmann::json::parse(fisheye.keys())["camera_model"] == "OPENCV_FISHEYE");
}

TEST_CASE("distorting_lens: the centre of an image is that of the pinhole, its rim shows more") {
  const nerf::SceneOptions options{.size = 48, .views = 1};
  const nerf::View view = nerf::make_scene(options).views.front();
  const Tensor<float> bent = distorted_image(options, view.camera, DistortingLens::equidistant());
  REQUIRE(bent.shape == view.rgba.shape);
  double centre = 0, rim = 0;
  const auto difference = [&](Index x, Index y) {
    const Index p = 4 * (y * 48 + x);
    return std::abs(static_cast<double>(bent[p + 3] * bent[p] - view.rgba[p + 3] * view.rgba[p]));
  };
  for (Index k = 0; k < 4; ++k) centre += difference(22 + k, 24) / 4;
  for (Index k = 0; k < 48; ++k) rim += (difference(k, 10) + difference(k, 38)) / 96;
  CHECK(centre < 0.05);
  CHECK(rim > 0.005);
  for (const float v : bent.data) CHECK((v >= 0 && v <= 1.0001f));
}
