// Finds the pose of an image's camera by gradients through volume rendering. Public headers only.
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/decay.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/values.h>
#include <fieldmark/nerf/camera.h>
#include <fieldmark/nerf/composite.h>
#include <fieldmark/nerf/rays.h>

#include <cmath>
#include <cstdio>
#include <vector>

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {

constexpr Index kSide = 24, kPixels = kSide * kSide, kSamples = 32, kBalls = 4;
constexpr float kNear = 2, kFar = 6, kStep = (kFar - kNear) / kSamples;

// Soft balls of light: place and colour.
const Tensor<float> kPlaces({kBalls, 3},
                            {-0.7f, 0.1f, 0.2f, 0.6f, -0.4f, 0.1f, 0.1f, 0.7f, -0.3f, 0, -0.2f, 0.8f});
const Tensor<float> kColours({kBalls, 3}, {1, 0.2f, 0.1f, 0.1f, 0.9f, 0.2f, 0.2f, 0.3f, 1, 0.9f, 0.8f, 0.1f});

// The image [pixels, 4] from a camera [16].
Var<float> render(Var<float> camera, const Tensor<float>& pixels, const Tensor<float>& depths,
                  const std::vector<Index>& ray_begin) {
  Tape<float>& tape = camera.tape();
  const Var<float> r = rays(camera, tape.constant(pixels));
  const Var<float> points = tape.reshape(slice(r, 1, 0, 3), {kPixels, 1, 3}) +
                            tape.reshape(slice(r, 1, 3, 3), {kPixels, 1, 3}) * tape.constant(depths);
  const Var<float> away = tape.reshape(points, {kPixels * kSamples, 1, 3}) - tape.constant(kPlaces);
  const Var<float> density = exp(sum(square(away), {2}) * -16.f) * 8.f;  // [samples, balls]
  const Var<float> sigma = sum(density, {1});
  const Var<float> rgb =
      batched_matmul(density, tape.constant(kColours)) / (tape.reshape(sigma, {sigma.shape()[0], 1}) + 1e-3f);
  static const Tensor<float> delta({kPixels * kSamples}, std::vector<float>(at(kPixels * kSamples), kStep));
  return composite(sigma, rgb, tape.constant(delta), ray_begin);
}

// Pose, then focal lengths and centre, as rays() takes them.
Tensor<float> numbers_of(const Camera& c) {
  const auto values = c.parameters();
  return {{16}, std::vector<float>(values.begin(), values.end())};
}

// Degrees between the axes of two cameras.
double degrees_apart(const Tensor<float>& a, const Tensor<float>& b) {
  double trace = 0;
  for (const Index i : {0, 1, 2, 4, 5, 6, 8, 9, 10}) trace += static_cast<double>(a[i] * b[i]);
  return std::acos(std::min(1.0, (trace - 1) / 2)) * 180 / 3.14159265358979;
}

}  // namespace

int main() {
  const Camera truth = make_camera(look_at({3, -2, 1.5}, {0, 0, 0}, {0, 0, 1}), 0.7, kSide, kSide);
  const Camera start =
      make_camera(look_at({3.2, -1.6, 1.2}, {0.1, 0.1, -0.1}, {0.1, 0, 1}), 0.7, kSide, kSide);
  Tensor<float> pixels({kPixels, 2}), depths({kSamples, 1});
  for (Index i = 0; i < kPixels; ++i) {
    pixels[2 * i] = static_cast<float>(i % kSide);
    pixels[2 * i + 1] = static_cast<float>(i / kSide);
  }
  for (Index k = 0; k < kSamples; ++k) depths[k] = kNear + kStep * (static_cast<float>(k) + 0.5f);
  std::vector<Index> ray_begin;
  for (Index i = 0; i <= kPixels; ++i) ray_begin.push_back(i * kSamples);

  Tape<float> tape;
  const Tensor<float> wanted = numbers_of(truth), eye({3, 3}, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  const Tensor<float> image = to_tensor(render(tape.constant(wanted), pixels, depths, ray_begin));
  Tensor<float> found = numbers_of(start), slope({16});
  Adam<float> adam(12, {.lr = 0.05, .beta2 = 0.99});  // of the pose; the lens is known
  std::printf("at first  %.2f degrees apart\n", degrees_apart(found, wanted));
  for (int step = 0; step < 300; ++step) {
    tape.reset();
    std::ranges::fill(slope.data, 0.f);
    const Var<float> camera = tape.leaf(found, slope);
    const Var<float> axes = slice(tape.part(camera, 0, {3, 4}), 1, 0, 3);
    const Var<float> not_rotation = sum(square(batched_matmul(transpose(axes), axes) - tape.constant(eye)));
    const Var<float> error = mse_loss(render(camera, pixels, depths, ray_begin), tape.constant(image));
    tape.backward(error + not_rotation * 0.1f);
    adam.step(std::span(found.data).first(12), std::span(slope.data).first(12), cosine_decay(step, 300));
    if (step % 100 == 0) std::printf("step %3d  loss %.6f\n", step, static_cast<double>(item(error)));
  }
  const double apart = degrees_apart(found, wanted);
  std::printf("at last   %.2f degrees apart\n", apart);
  return apart < 0.3 ? 0 : 1;
}
