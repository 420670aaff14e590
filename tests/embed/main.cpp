// Fits one number with the public engine: minimises mean((scale * x - y)^2), whose best scale is known, and
// checks an op of each other module by its gradient.
#include <fieldmark/distort/gradcheck_cases.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/nerf/gradcheck_cases.h>
#include <fieldmark/watermark/keys/key.h>
#include <fieldmark/watermark/payload/message.h>

#include <cmath>
#include <cstdio>

namespace {

// sum x y / sum x^2 = (2 + 8 + 15) / (1 + 4 + 9)
double fitted_scale() {
  const fieldmark::Tensor<double> x({3}, {1, 2, 3}), y({3}, {2, 4, 5});
  fieldmark::Tensor<double> scale({3}, 0.0), grad({3}, 0.0);
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

bool all_right(const std::vector<fieldmark::GradcheckCase>& cases) {
  for (const auto& check : cases)
    if (!check.run().ok) return false;
  return !cases.empty();
}

}  // namespace

int main() {
  const double scale = fitted_scale();
  std::printf("%s kernels, scale %.12f\n", fieldmark::isa_name(), scale);
  if (std::abs(scale - 25.0 / 14.0) > 1e-12) return 1;
  const auto message = fieldmark::watermark::message_from_hex("a0", 8);
  if (fieldmark::watermark::to_bits(message) != "10100000") return 3;
  if (fieldmark::watermark::random_key() == fieldmark::watermark::random_key()) return 4;
  return all_right(fieldmark::distort::gradcheck_cases()) && all_right(fieldmark::nerf::gradcheck_cases())
             ? 0
             : 2;
}
