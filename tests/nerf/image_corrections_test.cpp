#include "image_corrections.h"

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"
#include "vec3.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
constexpr double kPi = 3.14159265358979323846;

Camera camera_at(const Vec3& eye, const Vec3& target) {
  return make_camera(look_at(eye, target, {0, 1, 0}), 0.9, 9, 7);
}

std::span<float> pose_of(ImageCorrections& c, Index image) {
  return c.params.values(c.params.find("pose")).subspan(static_cast<std::size_t>(6 * image), 6);
}

// Returns a point that moves with a camera: its position in the camera's axes.
Vec3 in_camera(const Camera& c, const Vec3& p) {
  const Vec3 v = p - c.position();
  Vec3 out{};
  for (std::size_t a = 0; a < 3; ++a) out[a] = c.pose[a] * v[0] + c.pose[4 + a] * v[1] + c.pose[8 + a] * v[2];
  return out;
}
Vec3 in_world(const Camera& c, const Vec3& q) {
  Vec3 out = c.position();
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t a = 0; a < 3; ++a) out[r] += c.pose[4 * r + a] * q[a];
  return out;
}
}  // namespace

TEST_CASE("image_corrections: nothing learnt changes nothing, to the bit") {
  const Camera camera = camera_at({1, 2, 3}, {0, 0, 0});
  const ImageCorrections none({.images = 2}), both({.images = 2, .colour = true, .pose = true});
  CHECK_FALSE(none.moves());
  CHECK(both.moves());
  CHECK(none.params.size() == 0);
  CHECK(both.params.size() == 2 * (12 + 6));
  for (const auto* c : {&none, &both}) CHECK(c->moved(camera, 1).pose == camera.pose);
}

TEST_CASE("image_corrections: a quarter turn about z and a shift, in the world's axes") {
  ImageCorrections c({.images = 3, .pose = true, .length = 4});
  const auto p = pose_of(c, 1);
  p[2] = static_cast<float>(kPi / 2);
  p[3] = 0.5f;
  const Camera camera = camera_at({1, 2, 3}, {0, 0, 0}), moved = c.moved(camera, 1);
  for (std::size_t a = 0; a < 3; ++a) {
    CHECK(std::abs(moved.pose[a] + camera.pose[4 + a]) < 1e-6);
    CHECK(std::abs(moved.pose[4 + a] - camera.pose[a]) < 1e-6);
    CHECK(std::abs(moved.pose[8 + a] - camera.pose[8 + a]) < 1e-6);
  }
  CHECK(moved.position() == Vec3{3, 2, 3});
  CHECK(c.moved(camera, 0).pose == camera.pose);
}

TEST_CASE("image_corrections: the gradient of a motion is that of differences, in each space") {
  const Space spaces[] = {
      {.bounds = {.corner = {-1, 0, 2}, .side = 4}},
      {.kind = SpaceKind::ndc, .near = 1.25, .slope_x = 0.4, .slope_y = 0.7},
      {.kind = SpaceKind::contracted, .bounds = {.corner = {1, 2, 3}, .side = 2}, .near = 0.5}};
  for (const Space& space : spaces)
    for (const float turn : {0.f, 0.003f, 0.4f}) {
      CAPTURE(name_of(space.kind), turn);
      ImageCorrections c({.images = 2, .pose = true, .length = 2.5});
      const auto pose = pose_of(c, 1);
      for (std::size_t k = 0; k < 6; ++k) pose[k] = turn * (k % 2 == 0 ? 1.f : -0.5f);
      const Camera given = camera_at({0.3, 0.2, 0.4}, {0.2, 0.1, -4}), camera = c.moved(given, 1);
      // Samples whose images lie inside the cube, and a gradient for each.
      const auto x = uniform<float>({12, 3}, 0.05, 0.95, 3), g = uniform<float>({12, 3}, -1, 1, 4);
      std::vector<Vec3> held;
      for (Index i = 0; i < 12; ++i)
        held.push_back(in_camera(camera, space.to_world({x[3 * i], x[3 * i + 1], x[3 * i + 2]})));
      const auto loss = [&] {
        const Camera now = c.moved(given, 1);
        double sum = 0;
        for (std::size_t i = 0; i < 12; ++i) {
          const Vec3 image = space.to_cube(in_world(now, held[i]));
          for (std::size_t a = 0; a < 3; ++a)
            sum += image[a] * static_cast<double>(g[static_cast<Index>(3 * i + a)]);
        }
        return sum;
      };
      std::vector<float> grads(static_cast<std::size_t>(c.params.size()), 0.5f);
      c.add_motion(1, camera, space, x.data, g.data, grads.data());
      double largest = 0;
      for (std::size_t k = 6; k < 12; ++k) raise_to(largest, std::abs(double{grads[k]} - 0.5));
      CHECK(largest > 0.01);
      for (std::size_t k = 0; k < 6; ++k) {
        CAPTURE(k);
        const float before = pose[k], h = 1e-3f;
        pose[k] = before + h;
        const double up = loss(), step_up = double{pose[k]};
        pose[k] = before - h;
        const double slope = (up - loss()) / (step_up - double{pose[k]});
        pose[k] = before;
        CHECK(std::abs(double{grads[6 + k]} - 0.5 - slope) < 1e-3 * largest);  // h^2 of third derivatives
        CHECK(grads[k] == 0.5f);
      }
    }
}

TEST_CASE("image_corrections: samples at infinity count nothing") {
  const Space ndc{.kind = SpaceKind::ndc, .near = 1};
  ImageCorrections c({.images = 1, .pose = true});
  std::vector<float> grads(6, 0.f);
  const float x[] = {0.5f, 0.25f, 1}, dx[] = {1, 1, 1};
  c.add_motion(0, camera_at({0, 0, 0}, {0, 0, -1}), ndc, x, dx, grads.data());
  CHECK(grads == std::vector<float>(6, 0.f));
}

TEST_CASE("image_corrections: means over images are taken out of each parameter") {
  ImageCorrections c({.images = 4, .colour = true, .pose = true});
  const auto numbers = uniform<float>({c.params.size()}, -1, 1, 5);
  std::copy(numbers.data.begin(), numbers.data.end(), c.params.values().begin());
  c.hold_means();
  for (const auto& e : c.params.entries()) {
    const auto values = c.params.values(c.params.find(e.name));
    for (std::size_t k = 0; k < static_cast<std::size_t>(e.shape[1]); ++k) {
      const auto width = static_cast<std::size_t>(e.shape[1]);
      const float sum = values[k] + values[width + k] + values[2 * width + k] + values[3 * width + k];
      CHECK(std::abs(sum) < 1e-6f);
    }
  }
  CHECK(c.ranges().size() == 2);
}

TEST_CASE("image_corrections: colours of a ray are those of its image, and rays pass without any") {
  ImageCorrections c({.images = 2, .colour = true});
  c.params.values()[12] = 0.5f;  // of image 1: scales red by one and a half
  const Tensor<float> rays({2, 4}, {0.2f, 0.4f, 0.6f, 1, 0.2f, 0.4f, 0.6f, 1});
  const std::vector<Index> image{0, 1};
  std::vector<float> grads(24, 0.f);
  Tape<float> tape;
  const Var<float> seen = tape.constant(rays), out = c.coloured(seen, image, grads.data());
  CHECK(out.value()[0] == 0.2f);
  CHECK(out.value()[4] == Approx(0.3f));
  CHECK(ImageCorrections({.images = 2}).coloured(seen, image, nullptr).id() == seen.id());
}
