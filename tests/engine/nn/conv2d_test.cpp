#include <fieldmark/engine/nn/conv2d.h>

#include "support/expect_grad.h"

using namespace fieldmark;

TEST_CASE("nn conv2d: registers its parameters and applies them") {
  ParamStore<double> store;
  const Conv2d<double> layer(store, "c", {.in = 2, .out = 3}, 5);
  CHECK(store.entry(store.find("c/weight")).shape == Shape{3, 3, 2, 3});
  // A single pixel sees only the centre of the window.
  const auto w = store.values(store.find("c/weight"));
  Tape<double> tape;
  const Tensor<double> x({1, 1, 1, 2}, {1, 2});
  const auto y = layer(Params<double>(store), tape.constant(x));
  for (std::size_t o = 0; o < 3; ++o) CHECK(y.value()[o] == Approx(w[4 * 6 + o] + 2 * w[4 * 6 + 3 + o]));
}

TEST_CASE("nn conv2d: gradient in input and parameters") {
  ParamStore<double> store;
  const Conv2d<double> layer(store, "c", {.in = 2, .out = 3}, 5);
  const std::vector<Tensor<double>> x{uniform({1, 3, 4, 2}, -1, 1, 1)};
  const auto r = gradcheck_module([&](auto&, const auto& p, auto v) { return layer(p, v[0]); }, store, x);
  INFO(r.table);
  CHECK(r.ok);
}

TEST_CASE("nn conv2d: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH((Conv2d<float>(store, "c", {.in = 1, .out = 1, .kernel = 2}, 1)),
                    "[conv2d] in and out must be at least 1 and kernel odd, got in 1, out 1 and kernel 2");
}
