#include "scene_space.h"
#include "marching.h"

#include <cmath>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
View view(const Pose& pose, float alpha = 1) {
  View v{.camera = make_camera(pose, 0.9, 8, 6), .rgba = Tensor<float>({6, 8, 4}), .name = {}};
  for (float& x : v.rgba.data) x = alpha;
  return v;
}

Dataset around(Layout layout) {
  Dataset data;
  data.layout = layout;
  for (int i = 0; i < 8; ++i) {
    const double a = 0.7 * i;
    data.views.push_back(view(look_at({1 + 4 * std::cos(a), 2, 3 + 4 * std::sin(a)}, {1, 2, 3}, {0, 1, 0})));
  }
  return data;
}
}  // namespace

TEST_CASE("scene_space: rendered scenes and silhouettes are in a cube") {
  const Bounds bounds{.corner = {1, 2, 3}, .side = 4};
  CHECK(scene_space(around(Layout::blender), bounds).kind == SpaceKind::cube);
  Dataset data = around(Layout::transforms);
  CHECK_FALSE(has_alpha(data));
  data.views[3].rgba[7] = 0.5f;
  CHECK(has_alpha(data));
  const Space space = scene_space(data, bounds);
  CHECK(space.kind == SpaceKind::cube);
  CHECK(space.bounds.corner == bounds.corner);
  CHECK(space.bounds.side == 4);
}

TEST_CASE("scene_space: training images from around are contracted about what they show") {
  for (const Layout layout : {Layout::transforms, Layout::colmap, Layout::llff}) {
    const Space space = scene_space(around(layout));
    CHECK(space.kind == SpaceKind::contracted);
    for (std::size_t a = 0; a < 3; ++a) {
      const double middle[] = {1, 2, 3};
      CHECK(space.bounds.corner[a] + space.bounds.side / 2 == Approx(middle[a]));
    }
    CHECK(space.bounds.side == Approx(8));
    CHECK(space.near == Approx(0.08));
  }
}

TEST_CASE("scene_space: forward-facing rays enter by the near plane and leave by the far one") {
  Dataset data;
  data.layout = Layout::llff;
  data.forward_facing = true;
  const auto u = uniform({7, 3}, -0.4, 0.4, 8);
  for (Index i = 0; i < 7; ++i) {
    const Vec3 eye{u[3 * i], u[3 * i + 1], 0.2 * u[3 * i + 2]};
    data.views.push_back(view(look_at(eye, {0.1 * u[3 * i + 2], 0, -5}, {0, 1, 0})));
    data.views.back().depth = DepthRange{4. / 3 + 0.1 * static_cast<double>(i), 10};
  }
  const Space space = scene_space(data);
  CHECK(space.kind == SpaceKind::ndc);
  CHECK(space.near == Approx(0.95 * 4 / 3));
  float widest = 0;
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
      widest = std::max(widest, std::abs(rays.origins[i] - 0.5f));
    }
  }
  CHECK(widest > 0.45f);  // and not much room is lost
}

TEST_CASE("scene_space: without bounds the plane is at a distance of 1") {
  Dataset data;
  data.layout = Layout::llff;
  data.forward_facing = true;
  data.views.push_back(view({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}));
  CHECK(scene_space(data).near == 1);
}
