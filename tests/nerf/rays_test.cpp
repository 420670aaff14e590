#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/camera.h>
#include <fieldmark/nerf/rays.h>

#include <algorithm>
#include <cmath>

#include "support/expect_grad.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
Tensor<double> camera_tensor(double eye_x = 1.5) {
  Camera c = make_camera(look_at({eye_x, -3, 2}, {0.1, 0, 0.2}, {0, 0, 1}), 0.7, 40, 30);
  c.fy *= 1.1;
  const auto p = c.parameters();
  return {Shape{16}, {p.begin(), p.end()}};
}
Tensor<double> stacked_cameras(Index n) {
  Tensor<double> t(Shape{n, 16});
  for (Index i = 0; i < n; ++i) {
    const auto c = camera_tensor(1.5 + 0.4 * static_cast<double>(i));
    std::copy(c.data.begin(), c.data.end(), t.data.begin() + i * 16);
  }
  return t;
}
Var<double> rays_op(Tape<double>&, std::span<const Var<double>> v) { return rays(v[0], v[1]); }
}  // namespace

TEST_CASE("rays: equal to pixel_ray, for one camera and for one a pixel") {
  Camera c = make_camera(look_at({1.5, -3, 2}, {0, 0, 0}, {0, 0, 1}), 0.7, 40, 30);
  c.fy *= 1.3, c.cx -= 2.5;
  const auto p = c.parameters();
  const Tensor<double> one(Shape{16}, {p.begin(), p.end()});
  Tensor<double> each(Shape{5, 16});
  for (Index i = 0; i < 5; ++i) std::copy(p.begin(), p.end(), each.data.begin() + i * 16);
  const auto pixels = uniform({5, 2}, -10, 60, 1);
  Tape<double> tape;
  const auto a = rays(tape.constant(one), tape.constant(pixels));
  const auto b = rays(tape.constant(each), tape.constant(pixels));
  CHECK(a.shape() == Shape{5, 6});
  CHECK(std::equal(a.value(), a.value() + 30, b.value()));
  for (Index i = 0; i < 5; ++i) {
    const Ray r = pixel_ray(c, pixels[2 * i], pixels[2 * i + 1]);
    for (int k = 0; k < 3; ++k) {
      CHECK(a.value()[6 * i + k] == r.origin[static_cast<std::size_t>(k)]);
      CHECK(std::abs(a.value()[6 * i + 3 + k] - r.direction[static_cast<std::size_t>(k)]) < 1e-15);
    }
  }
}

TEST_CASE("rays: gradient in camera and pixels") {
  for (Index n : {0, 1, 4}) {
    expect_grad(rays_op, {camera_tensor(), uniform({n, 2}, -10, 50, 2)});
    expect_grad(rays_op, {stacked_cameras(n), uniform({n, 2}, -10, 50, 3)});
  }
}

TEST_CASE("rays: gradient where only one input needs it") {
  const auto camera = camera_tensor();
  const auto pixels = uniform({3, 2}, 0, 40, 4);
  expect_grad([&](Tape<double>& t, auto v) { return rays(v[0], t.constant(pixels)); }, {camera});
  expect_grad([&](Tape<double>& t, auto v) { return rays(t.constant(camera), v[0]); }, {pixels});
}

TEST_CASE("rays: errors name argument and shape") {
  const Tensor<float> camera(Shape{16}), pixels(Shape{3, 2}), wrong(Shape{2, 16}), row(Shape{3});
  Tape<float> t;
  CHECK_THROWS_WITH(rays(t.constant(camera), t.constant(row)),
                    "[rays] pixels must have rank 2 [N, 2], got shape [3]");
  CHECK_THROWS_WITH(rays(t.constant(row), t.constant(pixels)),
                    "[rays] camera: axis -1 must be 16 (pose, fx, fy, cx, cy), got shape [3]");
  CHECK_THROWS_WITH(rays(t.constant(wrong), t.constant(pixels)),
                    "[rays] camera: axis 0 must be 3 (one for each of pixels), got shape [2, 16]");
  CHECK_THROWS_WITH(rays(t.constant(camera), t.constant(camera)), Contains("[rays] pixels must have rank 2"));
}

TEST_CASE("rays: the same bits for one and two threads") {
  const auto camera = camera_tensor();
  const auto pixels = uniform({5000, 2}, 0, 40, 5);
  const auto seed = uniform({5000, 6}, -1, 1, 6);
  const auto run = [&](int n) {
    const ScopedThreads scope(n);
    Tensor<double> dc(camera.shape), dp(pixels.shape);
    Tape<double> t;
    t.backward(rays(t.leaf(camera, dc), t.leaf(pixels, dp)), seed.data);
    dc.data.insert(dc.data.end(), dp.data.begin(), dp.data.end());
    return dc.data;
  };
  CHECK(run(1) == run(2));
}
