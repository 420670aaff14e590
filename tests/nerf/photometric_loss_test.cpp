#include <fieldmark/nerf/photometric_loss.h>

#include <cmath>
#include <limits>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
auto op(const Tensor<double>& shot, const Tensor<double>& background, PhotometricLossOptions options) {
  return [&shot, &background, options](auto&, auto v) {
    return photometric_loss<double>(v[0], shot.data, background.data, options);
  };
}

// Computes the formula per channel as two images over one background.
double reference(const Tensor<double>& rays, const Tensor<double>& truth, const Tensor<double>& back,
                 double huber, double scale) {
  double sum = 0;
  const Index n = rays.shape[0];
  for (Index r = 0; r < n; ++r)
    for (Index k = 0; k < 3; ++k) {
      const double b = back[3 * r + k], a = truth[4 * r + 3];
      const double ours = rays[4 * r + k] + (1 - rays[4 * r + 3]) * b,
                   theirs = a * truth[4 * r + k] + (1 - a) * b;
      const double e = std::abs(ours - theirs);
      sum += e <= huber ? e * e / 2 : huber * e - huber * huber / 2;
    }
  return n > 0 ? scale * sum / (3 * static_cast<double>(n)) : 0;
}
}  // namespace

TEST_CASE("photometric_loss: equal to the formula, square and Huber") {
  const auto rays = uniform({40, 4}, 0, 1, 1), truth = uniform({40, 4}, 0, 1, 2),
             back = uniform({40, 3}, 0, 1, 3);
  for (const double huber : {0.01, 0.1, 5.0, std::numeric_limits<double>::infinity()}) {
    CAPTURE(huber);
    const auto y = op_values<double>(op(truth, back, {.huber = huber, .scale = 1.5}), {rays});
    CHECK(std::abs(y[0] - reference(rays, truth, back, huber, 1.5)) < 1e-15);
  }
}

TEST_CASE("photometric_loss: zero for a perfect rendering, whatever the background") {
  // With powers of two, premultiplying is exact.
  const Tensor<double> truth(Shape{1, 4}, {0.5, 0.25, 1, 0.5}), rays(Shape{1, 4}, {0.25, 0.125, 0.5, 0.5});
  for (const double b : {0.0, 0.5, 1.0}) {
    const Tensor<double> back(Shape{1, 3}, b);
    CHECK(op_values<double>(op(truth, back, {}), {rays})[0] == 0);
  }
}

TEST_CASE("photometric_loss: gradient on both sides of the kink") {
  for (const Index n : {0, 1, 5}) {
    const auto truth = uniform({n, 4}, 0, 1, 2), back = uniform({n, 3}, 0, 1, 3);
    expect_grad(op(truth, back, {.huber = 3}), {uniform({n, 4}, 0, 1, 1)});
    expect_grad(op(truth, back, {.huber = 1e-3, .scale = 2}), {uniform({n, 4}, 2, 3, 1)});
  }
}

TEST_CASE("photometric_loss: errors name argument and what came") {
  Tape<double> t;
  const Tensor<double> rays(Shape{2, 4}), wrong(Shape{2, 3}), truth(Shape{2, 4}), back(Shape{2, 3});
  const auto run = [&](const Tensor<double>& r, const Tensor<double>& b, double huber) {
    photometric_loss<double>(t.constant(r), truth.data, b.data, {.huber = huber});
  };
  CHECK_THROWS_WITH(
      run(wrong, back, 1),
      "[photometric_loss] rays: axis 1 must be 4 (red, green, blue, opacity), got shape [2, 3]");
  CHECK_THROWS_WITH(run(rays, truth, 1), Contains("3 elements a ray (2 rays), got 8 and 8"));
  CHECK_THROWS_WITH(run(rays, back, 0), Contains("[photometric_loss] huber must be positive, got 0"));
  CHECK_THROWS_AS(run(rays, back, std::nan("")), ValueError);
}

TEST_CASE("photometric_loss: the same bits for one and two threads") {
  constexpr Index kRays = 100000;
  const auto truth = uniform<float>({kRays, 4}, 0, 1, 2), back = uniform<float>({kRays, 3}, 0, 1, 3);
  expect_same_bits([&](auto&, auto v) { return photometric_loss<float>(v[0], truth.data, back.data); },
                   {uniform<float>({kRays, 4}, 0, 1, 1)});
}

TEST_CASE("photometric_loss: takes vectors, with the type of the Var") {
  const std::vector<double> truth{1, 1, 1, 1}, back{0, 0, 0};
  const auto op = [&](auto&, auto v) { return photometric_loss(v[0], truth, back); };
  const Tensor<double> rays(Shape{1, 4}, {0.75, 0.75, 0.75, 1});
  CHECK(op_values<double>(op, {rays})[0] == Approx(0.1 * 0.25 - 0.1 * 0.1 / 2).epsilon(1e-14));
}
