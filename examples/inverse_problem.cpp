// Deblurs a signal whose blur and noise are unknown: both are estimated by maximum likelihood, with gradients
// through a Cholesky factor. Public headers only.
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/ops.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/values.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace fieldmark;

namespace {

constexpr Index kPoints = 60;
constexpr double kBlur = 2, kNoise = 0.02;  // the values to find

// Blur matrix of a width [1]: rows exp(-d^2 / 2 width^2) that sum to 1.
Var<double> blur(Var<double> width, const Tensor<double>& square_apart) {
  const Var<double> rows = exp(width.tape().constant(square_apart) / (width * width * -2.0));
  return rows / sum(rows, {1}, KeepAxes::yes);
}

}  // namespace

int main() {
  // The signal is a random walk whose steps have variance 0.05.
  Tensor<double> apart({kPoints, kPoints}), walk = apart, eye = apart, truth({kPoints, 1}), noise = truth;
  const CounterRng rng(4, 0);
  for (Index i = 0; i < kPoints; ++i) {
    for (Index j = 0; j < kPoints; ++j) {
      apart[i * kPoints + j] = static_cast<double>((i - j) * (i - j));
      walk[i * kPoints + j] = 0.05 * static_cast<double>(std::min(i, j) + 1);
    }
    eye[i * kPoints + i] = 1;
    truth[i] = (i > 0 ? truth[i - 1] : 0) + std::sqrt(0.05) * static_cast<double>(rng.normal2(at(i))[0]);
    noise[i] = kNoise * static_cast<double>(rng.normal2(at(i))[1]);
  }
  const Tensor<double> one({1}, {kBlur});
  Tape<double> tape;
  const Tensor<double> seen =
      to_tensor(batched_matmul(blur(tape.constant(one), apart), tape.constant(truth)) + tape.constant(noise));

  ParamStore<double> store;
  const ParamId log_blur = store.add("log_blur", {1}), log_noise = store.add("log_noise", {1});
  store.values(log_noise)[0] = std::log(0.2);
  const Params<double> p(store);
  Adam<double> adam(store, {.lr = 0.05});
  Tensor<double> sharp;
  for (int step = 0; step < 200; ++step) {
    tape.reset();
    store.zero_grad();
    const Var<double> a = blur(exp(p.leaf(tape, log_blur)), apart), c = tape.constant(walk);
    const Var<double> deviation = exp(p.leaf(tape, log_noise)), identity = tape.constant(eye);
    const Var<double> ca = batched_matmul(c, transpose(a));
    const Var<double> l = cholesky(batched_matmul(a, ca) + deviation * deviation * identity);
    const Var<double> whitened = triangular_solve(l, tape.constant(seen));
    // -log N(seen; 0, L L^T), without its constant.
    const Var<double> cost = sum(square(whitened)) * 0.5 + sum(log(sum(l * identity, {1})));
    sharp = to_tensor(batched_matmul(ca, triangular_solve(l, whitened, {.transposed = true})));
    tape.backward(cost);
    adam.step(store.values(), store.grads());
    if (step % 50 == 0) std::printf("step %3d  cost %8.3f\n", step, item(cost));
  }
  const auto error = [&](const Tensor<double>& x) {
    return std::sqrt(item(mse_loss(tape.constant(x), tape.constant(truth))));
  };
  const double width = std::exp(store.values(log_blur)[0]), deviation = std::exp(store.values(log_noise)[0]);
  std::printf("blur %.2f (2), noise %.3f (0.02); error %.3f as seen, %.3f sharpened\n", width, deviation,
              error(seen), error(sharp));
  return std::abs(width - kBlur) < 0.4 && error(sharp) < 0.8 * error(seen) ? 0 : 1;
}
