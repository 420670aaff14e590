// Uses the installed package as an outside program does: fits one parameter, gradient-checks an op of each
// module, reads a message and draws keys.
#include <fieldmark/distort/blur.h>
#include <fieldmark/engine/gradcheck.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/nerf/spherical_harmonics.h>
#include <fieldmark/watermark/keys/key.h>
#include <fieldmark/watermark/payload/message.h>

#include <cmath>
#include <cstdio>

namespace {

using Tensor = fieldmark::Tensor<double>;
using Vars = std::span<const fieldmark::Var<double>>;

// Minimises mean((scale x - y)^2): sum x y / sum x^2 = (2 + 8 + 15) / (1 + 4 + 9).
double fitted_scale() {
  const Tensor x({3}, {1, 2, 3}), y({3}, {2, 4, 5});
  Tensor scale({3}, 0.0), grad({3}, 0.0);
  fieldmark::Tape<double> tape;
  for (int step = 0; step < 200; ++step) {
    tape.reset();
    const auto s = tape.leaf(scale, grad);
    tape.backward(fieldmark::mse_loss(fieldmark::mul(s, tape.constant(x)), tape.constant(y)));
    const double sum = grad[0] + grad[1] + grad[2];
    for (int i = 0; i < 3; ++i) {
      scale[i] -= 0.1 * sum;
      grad[i] = 0;
    }
  }
  return scale[0];
}

bool gradients_agree(const fieldmark::GradcheckFn& f, const std::vector<Tensor>& inputs) {
  const fieldmark::GradcheckReport report = fieldmark::gradcheck(f, inputs);
  std::printf("%s", report.table.c_str());
  return report.ok && report.entries > 0;
}

}  // namespace

int main() {
  const double scale = fitted_scale();
  std::printf("%s kernels, scale %.12f\n", fieldmark::isa_name(), scale);
  if (std::abs(scale - 25.0 / 14.0) > 1e-12) return 1;
  const Tensor image({2, 2, 1}, {0.1, 0.7, 0.4, 0.9}), sigma({1}, 0.6), directions({1, 3}, {0.36, 0.48, 0.8});
  if (!gradients_agree([](auto&, Vars v) { return fieldmark::distort::blur(v[0], v[1]); }, {image, sigma}))
    return 2;
  if (!gradients_agree([](auto&, Vars v) { return fieldmark::nerf::spherical_harmonics(v[0]); },
                       {directions}))
    return 3;
  const auto message = fieldmark::watermark::message_from_hex("a0", 8);
  if (fieldmark::watermark::to_bits(message) != "10100000") return 4;
  return fieldmark::watermark::random_key() == fieldmark::watermark::random_key() ? 5 : 0;
}
