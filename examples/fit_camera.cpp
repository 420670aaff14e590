// Recovers the camera pose of an image by gradients through volume rendering. Public headers only.
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/decay.h>
#include <fieldmark/engine/ops.h>
#include <fieldmark/engine/values.h>
#include <fieldmark/nerf/camera.h>
#include <fieldmark/nerf/composite.h>
#include <fieldmark/nerf/rays.h>

#include <cmath>
#include <cstdio>
#include <vector>

using namespace fieldmark;

constexpr Index kSide = 24, kPixels = kSide * kSide, kSamples = 32;

// Four soft glowing balls with positions and colours, rendered along the rays of 24 x 24 pixels in 32 steps.
struct Scene {
  Tensor<float> places{{4, 3}, {-0.7f, 0.1f, 0.2f, 0.6f, -0.4f, 0.1f, 0.1f, 0.7f, -0.3f, 0, -0.2f, 0.8f}},
      colours{{4, 3}, {1, 0.2f, 0.1f, 0.1f, 0.9f, 0.2f, 0.2f, 0.3f, 1, 0.9f, 0.8f, 0.1f}};
  Tensor<float> pixels{{kPixels, 2}}, depths{{kSamples, 1}}, steps{{kPixels * kSamples}, 0.125f};
  std::vector<Index> ray_begin{0};

  Scene() {
    for (Index k = 0; k < kSamples; ++k) depths[k] = 2 + 0.125f * (static_cast<float>(k) + 0.5f);
    for (Index i = 0; i < 2 * kPixels; ++i)
      pixels[i] = static_cast<float>(i / (i % 2 ? 2 * kSide : 2) % kSide);
    for (Index i = 1; i <= kPixels; ++i) ray_begin.push_back(i * kSamples);
  }
  // Renders the image [pixels, 4] of a camera [16].
  Var<float> operator()(Var<float> camera) const {
    Tape<float>& tape = camera.tape();
    const auto r = reshape(nerf::rays(camera, tape.constant(pixels)), {kPixels, 1, 6});
    const auto points = slice(r, 2, 0, 3) + slice(r, 2, 3, 3) * tape.constant(depths);
    const auto away = reshape(points, {kPixels * kSamples, 1, 3}) - tape.constant(places);
    const auto density = exp(sum(square(away), {2}) * -16.f) * 8.f;  // [samples, balls]
    const auto rgb = matmul(density, tape.constant(colours)) / (sum(density, {1}, KeepAxes::yes) + 1e-3f);
    return nerf::composite(sum(density, {1}), rgb, tape.constant(steps), ray_begin);
  }
};

int main() {
  const auto lens = [](const nerf::Pose& pose) {
    const auto numbers = nerf::make_camera(pose, 0.7, kSide, kSide).parameters();
    return Tensor<float>({16}, std::vector<float>(numbers.begin(), numbers.end()));
  };
  const Tensor<float> truth = lens(nerf::look_at({3, -2, 1.5}, {0, 0, 0}, {0, 0, 1}));
  Tensor<float> found = lens(nerf::look_at({3.2, -1.6, 1.2}, {0.1, 0.1, -0.1}, {0.1, 0, 1})), slope({16});
  const auto degrees_apart = [&] {
    double sum = 0;  // |R - R'|^2 = 8 sin^2(angle / 2)
    for (const Index i : {0, 1, 2, 4, 5, 6, 8, 9, 10}) sum += std::pow(found[i] - truth[i], 2);
    return 2 * std::asin(std::sqrt(sum / 8)) * 180 / 3.14159265358979;
  };
  const Scene render;
  Tape<float> tape;
  const Tensor<float> seen = to_tensor(render(tape.constant(truth))),
                      eye({3, 3}, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  Adam<float> adam(12, {.lr = 0.05, .beta2 = 0.99, .zero_grads = true});  // the pose; the lens is known
  for (int step = 0; step <= 300; ++step, tape.reset()) {
    if (step % 100 == 0) std::printf("step %3d  %.2f degrees apart\n", step, degrees_apart());
    const auto camera = tape.leaf(found, slope);
    const auto axes = slice(reshape(slice(camera, 0, 12), {3, 4}), 1, 0, 3);
    const auto not_rotation = sum(square(matmul(transpose(axes), axes) - tape.constant(eye)));
    tape.backward(mse_loss(render(camera), tape.constant(seen)) + not_rotation * 0.1f);
    adam.step(std::span(found.data).first(12), std::span(slope.data).first(12), cosine_decay(step, 300));
  }
  return degrees_apart() < 0.3 ? 0 : 1;
}
