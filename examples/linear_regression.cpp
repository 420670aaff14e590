// Fits a line through five points. Public headers only.
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/sgd.h>

#include <cmath>
#include <cstdio>

using namespace fieldmark;

int main() {
  const Tensor<double> x({5}, {0, 1, 2, 3, 4}), y({5}, {1, 2.9, 5.1, 7, 9});
  ParamStore<double> store;
  const ParamId slope = store.add("slope", {}), offset = store.add("offset", {});
  const Params<double> params(store);
  Sgd<double> sgd(store, {.lr = 0.05, .momentum = 0.8});
  Tape<double> tape;
  for (int step = 0; step < 300; ++step) {
    tape.reset();
    store.zero_grad();
    const auto line = params.leaf(tape, slope) * tape.constant(x) + params.leaf(tape, offset);
    tape.backward(mean(square(line - tape.constant(y))));
    sgd.step(store.values(), store.grads());
  }
  std::printf("y = %.4f x + %.4f\n", store.values(slope)[0], store.values(offset)[0]);
  return std::hypot(store.values(slope)[0] - 2.01, store.values(offset)[0] - 0.98) < 1e-9 ? 0 : 1;
}
