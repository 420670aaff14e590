#include "scene_solids.h"

#include <fieldmark/core/error.h>
#include <fieldmark/nerf/camera_set.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {

Camera eye_at(const Vec3& eye) { return make_camera(look_at(eye, {0, 0, 0}, {0, 0, 1}), 0.6911, 64, 64); }

// Returns the share of a view's opaque pixels whose colour differs from that of the right neighbour by less
// than a step.
double flat_share(SceneKind kind) {
  const Tensor<float> image = render_scene({.kind = kind, .size = 64}, eye_at({3, -1.5, 2}));
  double flat = 0, all = 0;
  for (Index i = 0; i + 7 < image.size(); i += 4) {
    if (image[i + 3] < 1 || image[i + 7] < 1) continue;
    all += 1;
    flat += std::abs(image[i] - image[i + 4]) + std::abs(image[i + 1] - image[i + 5]) < 0.02f ? 1 : 0;
  }
  REQUIRE(all > 100);
  return flat / all;
}

// Returns the largest difference in colour of a point on top of a scene's first solid, seen from two sides.
double change_of_side(SceneKind kind) {
  const Solid first = scene_solids(kind, 0)[0].solid;
  double most = 0;
  Vec3 colours[2];
  for (int side = 0; side < 2; ++side) {
    Vec3 top = first.centre;
    top[2] += first.size[0];
    const double sign = side == 0 ? 1 : -1;  // the sun is in (0.45, -0.4, 0.8)
    const Vec3 eye{top[0] - 1.35 * sign, top[1] + 1.2 * sign, top[2] + 2.4};
    const Camera camera = make_camera(look_at(eye, top, {0, 0, 1}), 0.01, 1, 1);
    const Tensor<float> pixel = render_scene({.kind = kind, .size = 1}, camera);
    REQUIRE(pixel[3] == 1);
    for (Index c = 0; c < 3; ++c) colours[side][static_cast<std::size_t>(c)] = static_cast<double>(pixel[c]);
  }
  for (std::size_t c = 0; c < 3; ++c) raise_to(most, std::abs(colours[0][c] - colours[1][c]));
  return most;
}

}  // namespace

TEST_CASE("scene_solids: within 1.2 of the origin, equal for equal seeds") {
  for (const SceneKind kind : kSceneKinds)
    for (const std::uint64_t seed : {0, 5}) {
      CAPTURE(scene_kind_name(kind), seed);
      const auto solids = scene_solids(kind, seed), again = scene_solids(kind, seed);
      REQUIRE(!solids.empty());
      REQUIRE(again.size() == solids.size());
      for (std::size_t i = 0; i < solids.size(); ++i) {
        const SceneSolid& s = solids[i];
        CHECK(again[i].solid.centre == s.solid.centre);
        CHECK(again[i].texture.a == s.texture.a);
        CHECK((s.gloss > 0) == (kind == SceneKind::glossy));
        for (const Shade& shade : s.shades)
          CHECK(std::hypot(shade.centre[0], shade.centre[1], shade.centre[2]) < 1.2);
        CHECK(std::hypot(s.solid.centre[0], s.solid.centre[1], s.solid.centre[2]) < 1.2);
      }
      const auto other = scene_solids(kind, seed + 2);
      const auto same_colour = [&](const SceneSolid& a, const SceneSolid& b) {
        return a.texture.a == b.texture.a;
      };
      CHECK(!std::ranges::equal(other, solids, same_colour));
    }
}

TEST_CASE("scene_solids: wires are thin, plain surfaces flat, glossy ones look different from two sides") {
  const auto wires = scene_solids(SceneKind::wires, 0);
  CHECK(std::ranges::count_if(wires, [](const SceneSolid& s) {
          return std::min({s.solid.size[0], s.solid.size[1] > 0 ? s.solid.size[1] : 1.0}) < 0.025;
        }) == static_cast<std::ptrdiff_t>(wires.size()));
  CHECK(flat_share(SceneKind::plain) > 0.6);
  CHECK(flat_share(SceneKind::plain) > flat_share(SceneKind::objects) + 0.1);
  CHECK(change_of_side(SceneKind::glossy) > 0.3);
  CHECK(change_of_side(SceneKind::objects) <= 1.0 / 255 + 1e-6);
}

TEST_CASE("scene_solids: names of scenes there and back, others are refused") {
  for (const SceneKind kind : kSceneKinds) CHECK(parse_scene_kind(scene_kind_name(kind)) == kind);
  CHECK_THROWS_WITH(parse_scene_kind("cube"),
                    "[scene] kind must be objects, sphere, wires, plain or glossy, got \"cube\"");
}
