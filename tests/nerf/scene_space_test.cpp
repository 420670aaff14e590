#include "scene_space.h"
#include "marching.h"

#include <fieldmark/nerf/camera_set.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
View view(const Pose& pose, float alpha = 1) {
  View v{.camera = make_camera(pose, 0.9, 8, 6), .rgba = Tensor<float>({6, 8, 4}), .name = {}};
  for (float& x : v.rgba.data) x = alpha;
  return v;
}

Dataset around(SceneType scene) {
  Dataset data;
  data.scene = scene;
  for (int i = 0; i < 8; ++i) {
    const double a = 0.7 * i;
    data.views.push_back(view(look_at({1 + 4 * std::cos(a), 2, 3 + 4 * std::sin(a)}, {1, 2, 3}, {0, 1, 0})));
  }
  return data;
}
}  // namespace

TEST_CASE("scene_space: rendered scenes and silhouettes are in a cube") {
  const Bounds bounds{.corner = {1, 2, 3}, .side = 4};
  CHECK(scene_space(around(SceneType::plain), bounds).kind == SpaceKind::cube);
  Dataset data = around(SceneType::object);
  CHECK_FALSE(has_alpha(data));
  const Space space = scene_space(data, bounds);
  CHECK(space.kind == SpaceKind::cube);
  CHECK(space.bounds.corner == bounds.corner);
  CHECK(space.bounds.side == 4);
  data.views[3].rgba[7] = 0.5f;
  CHECK(has_alpha(data));
}

TEST_CASE("scene_space: training images from around are contracted about what they show") {
  const Space space = scene_space(around(SceneType::place));
  CHECK(space.kind == SpaceKind::contracted);
  for (std::size_t a = 0; a < 3; ++a) {
    const double middle[] = {1, 2, 3};
    CHECK(space.bounds.corner[a] + space.bounds.side / 2 == Approx(middle[a]));
  }
  CHECK(space.bounds.side == Approx(8));
  CHECK(space.near == Approx(0.08));
}

TEST_CASE(
    "scene_space: an object that reaches out of the usual cube, or is lost in it, gets the cameras' cube") {
  // A ball in the middle of all images; its cube is that of the cameras.
  Dataset data;
  for (int i = 0; i < 12; ++i) {
    const double a = 0.6 * i;
    View v{.camera = make_camera(
               look_at({4 * std::cos(a), 4 * std::sin(a), i % 3 - 1.}, {0, 0, 0}, {0, 0, 1}), 0.9, 48, 48),
           .rgba = Tensor<float>({48, 48, 4}),
           .name = {}};
    for (Index p = 0; p < 48 * 48; ++p)
      v.rgba[4 * p + 3] =
          std::hypot(static_cast<double>(p % 48) - 23.5, static_cast<double>(p / 48) - 23.5) < 12;
    data.views.push_back(std::move(v));
  }
  const auto side_at = [&](double scale) {
    Dataset scaled = data;
    for (View& v : scaled.views)
      for (const std::size_t a : {3u, 7u, 11u}) v.camera.pose[a] *= scale;
    return scene_space(scaled).bounds.side;
  };
  const double usual = Bounds{}.side, seen = 2 * camera_span(data).half_size;
  CHECK(side_at(1) == usual);
  CHECK(side_at(0.1) == usual);
  CHECK(side_at(1e-3) == Approx(1e-3 * seen));
  CHECK(side_at(1.3) == usual);  // the cameras see farther, but the ball ends inside
  CHECK(side_at(10) == Approx(10 * seen));
  CHECK(side_at(1e4) == Approx(1e4 * seen));
}

TEST_CASE("scene_space: forward-facing rays enter by the near plane and leave by the far one") {
  Dataset data;
  data.scene = SceneType::forward;
  const auto u = uniform({7, 3}, -0.4, 0.4, 8);
  for (Index i = 0; i < 7; ++i) {
    const Vec3 eye{u[3 * i], u[3 * i + 1], 0.2 * u[3 * i + 2]};
    data.views.push_back(view(look_at(eye, {0.1 * u[3 * i + 2], 0, -5}, {0, 1, 0})));
    data.views.back().depth = DepthRange{4. / 3 + 0.1 * static_cast<double>(i), 10};
  }
  const Space space = scene_space(data);
  CHECK(space.kind == SpaceKind::ndc);
  CHECK(space.near == Approx(0.95 * 4 / 3));
  double widest = 0;
  for (const View& v : data.views) {
    CubeRays rays;
    rays.resize(4);
    const float corners[] = {-0.5f, -0.5f, 7.5f, -0.5f, -0.5f, 5.5f, 7.5f, 5.5f};
    rays.set(space, 0, v.camera, corners);
    for (std::size_t i = 0; i < 12; i += 3) {
      const CubeSpan span = intersect_unit_cube(&rays.origins[i], &rays.directions[i]);
      const auto z = [&](float t) { return rays.origins[i + 2] + t * rays.directions[i + 2]; };
      CHECK(std::abs(z(span.near)) < 1e-5f);
      CHECK(std::abs(z(span.far) - 1) < 1e-5f);
      raise_to(widest, std::abs(rays.origins[i] - 0.5));
    }
  }
  CHECK((widest > 0.45 && widest < 0.6));  // little room is lost
}

TEST_CASE("scene_space: without bounds the plane is at a distance of 1") {
  Dataset data;
  data.scene = SceneType::forward;
  data.views.push_back(view({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}));
  CHECK(scene_space(data).near == 1);
}
