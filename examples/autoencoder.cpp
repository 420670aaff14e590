// Compresses images of discs to 32 numbers with convolutions and reconstructs them. Public headers only.
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/decay.h>
#include <fieldmark/engine/nn.h>
#include <fieldmark/engine/ops.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/values.h>

#include <cmath>
#include <cstdio>

using namespace fieldmark;

namespace {

constexpr Index kSide = 16, kImages = 32, kSteps = 300;

// Draws discs [N, 16, 16, 1] with soft edges, of random position and size.
Tensor<float> discs(std::uint64_t draw) {
  const CounterRng rng(1, 0);
  Tensor<float> images({kImages, kSide, kSide, 1});
  for (Index n = 0; n < kImages; ++n) {
    const auto number = [&](std::uint64_t k, float low, float high) {
      return low + (high - low) * rng.uniform(draw * kImages + static_cast<std::uint64_t>(n), k);
    };
    const float x = number(0, 4, 12), y = number(1, 4, 12), radius = number(2, 2, 4);
    for (Index i = 0; i < kSide * kSide; ++i) {
      const float d = std::hypot(static_cast<float>(i % kSide) - x, static_cast<float>(i / kSide) - y);
      images[n * kSide * kSide + i] = 1 / (1 + std::exp(2 * (d - radius)));
    }
  }
  return images;
}

}  // namespace

int main() {
  ParamStore<float> store;
  const auto relu = Activation::relu;
  const Conv2d<float> e1(store, "e1", {.in = 1, .out = 8, .activation = relu}, 1),
      e2(store, "e2", {.in = 8, .out = 16, .activation = relu}, 2),
      code(store, "code", {.in = 16, .out = 2}, 3),
      d1(store, "d1", {.in = 2, .out = 16, .activation = relu}, 4),
      d2(store, "d2", {.in = 16, .out = 8, .activation = relu}, 5),
      image(store, "image", {.in = 8, .out = 1}, 6);
  Adam<float> adam(store, {.lr = 4e-3});
  const Params<float> p(store);
  Tape<float> tape;
  const auto error = [&](const Tensor<float>& images) {
    const Var<float> x = tape.constant(images);
    const Var<float> z = code(p, avg_pool(e2(p, avg_pool(e1(p, x), 2)), 2));  // [N, 4, 4, 2]
    return mse_loss(image(p, d2(p, upsample_nearest(d1(p, upsample_nearest(z, 2)), 2))), x);
  };
  for (Index step = 0; step < kSteps; ++step) {
    tape.reset();
    store.zero_grad();
    const Tensor<float> images = discs(static_cast<std::uint64_t>(step));
    const Var<float> loss = error(images);
    tape.backward(loss);
    adam.step(store.values(), store.grads(), cosine_decay(step, kSteps));
    if (step % 100 == 0) std::printf("step %3d  loss %.5f\n", static_cast<int>(step), item(loss));
  }
  tape.reset();
  const Tensor<float> others = discs(kSteps);
  const double left = static_cast<double>(item(error(others)));
  const double spread = item(variance(tape.constant(others), {0, 1, 2, 3}));
  std::printf("other discs: %.1f%% of their variance is left\n", 100 * left / spread);
  return left < 0.05 * spread ? 0 : 1;
}
