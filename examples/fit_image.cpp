// Fits an image with a small network: colour as a function of position. Public headers only.
//   fit_image [IMAGE.png [RESULT.png]]      default: a built-in pattern
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/decay.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/values.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/frequency_encoding.h>

#include <chrono>
#include <cmath>
#include <cstdio>

using namespace fieldmark;

namespace {

Tensor<float> pattern() {
  Tensor<float> image({48, 64, 3});
  for (Index i = 0; i < image.size(); ++i) {
    const double x = static_cast<double>(i / 3 % 64) / 64, y = static_cast<double>(i / 192) / 48;
    image[i] = static_cast<float>(0.5 + 0.5 * std::sin(6 * x + 9 * y * y + 2 * static_cast<double>(i % 3)));
  }
  return image;
}

}  // namespace

int main(int argc, char** argv) {
  const Tensor<float> image = argc > 1 ? read_image(argv[1]) : pattern();
  const Index height = image.shape[0], width = image.shape[1], channels = image.shape[2],
              pixels = height * width;
  Tensor<float> place({pixels, 2});
  for (Index p = 0; p < pixels; ++p) {
    place[2 * p] = static_cast<float>(p % width) / static_cast<float>(width);
    place[2 * p + 1] = static_cast<float>(p / width) / static_cast<float>(height);
  }

  constexpr int kBands = 5, kSteps = 400;
  Tape<float> tape;
  const Tensor<float> encoded = to_tensor(nerf::frequency_encoding(tape.constant(place), kBands));

  // Layers register their parameters in a store; the optimiser updates them.
  ParamStore<float> store;
  const Dense<float> first(store, "first", {.in = 4 * kBands, .out = 48, .activation = Activation::relu}, 1);
  const Dense<float> second(store, "second", {.in = 48, .out = 48, .activation = Activation::relu}, 2);
  const Dense<float> last(store, "last", {.in = 48, .out = channels}, 3);
  Adam<float> adam(store, {.lr = 5e-3, .beta2 = 0.99, .zero_grads = true});
  const Params<float> params(store);

  Tensor<float> result(image.shape);
  const auto begun = std::chrono::steady_clock::now();
  for (int step = 0; step < kSteps; ++step) {
    tape.reset();
    const Var<float> colour = sigmoid(last(params, second(params, first(params, tape.constant(encoded)))));
    const Var<float> loss = mse_loss(colour, tape.constant(image.data.data(), {pixels, channels}));
    if (step % 100 == 0) std::printf("step %3d  loss %.5f\n", step, static_cast<double>(item(loss)));
    tape.backward(loss);
    adam.step(store.values(), store.grads(), cosine_decay(step, kSteps));
    if (step + 1 == kSteps) result.data = to_tensor(colour).data;
  }
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - begun;
  const double reached = psnr(result, image);
  std::printf("PSNR %.1f dB, %.3f ms a step\n", reached, taken.count() / kSteps);
  if (argc > 2) write_png(argv[2], result);
  return argc > 1 || reached > 25 ? 0 : 1;
}
