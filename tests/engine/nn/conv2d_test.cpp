#include <fieldmark/engine/nn/conv2d.h>

#include "support/expect_grad.h"

using namespace fieldmark;

TEST_CASE("nn conv2d: registers its parameters and applies them") {
  ParamStore<double> store;
  const Conv2d<double> layer(store, "c", {.in = 2, .out = 3}, 5);
  CHECK(store.entry(store.find("c/weight")).shape == Shape{3, 3, 2, 3});
  // A single pixel sees only the window's centre.
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

TEST_CASE("nn conv2d: stride, padding, and no bias are those of the op") {
  ParamStore<double> store;
  const Conv2d<double> layer(store, "c",
                             {.in = 2, .out = 3, .kernel = 4, .stride = 2, .padding = 1, .bias = false}, 5),
      centred(store, "d", {.in = 2, .out = 3, .stride = 2}, 6);
  CHECK(store.entries().size() == 3);
  const std::vector<Tensor<double>> x{uniform({1, 4, 6, 2}, -1, 1, 1)};
  const Tensor<double> zeros({3});
  Tape<double> tape;
  const Params<double> params(store);
  const auto in = tape.constant(x[0]), y = layer(params, in);
  CHECK(y.shape() == Shape{1, 2, 3, 3});
  CHECK(centred(params, in).shape() == Shape{1, 2, 3, 3});
  const auto want = conv2d(in, params.leaf(tape, store.find("c/weight")), tape.constant(zeros),
                           {.stride = 2, .padding = 1});
  CHECK(std::equal(y.value(), y.value() + y.shape().size(), want.value()));
  const auto r = gradcheck_module([&](auto&, const auto& p, auto v) { return layer(p, v[0]); }, store, x);
  INFO(r.table);
  CHECK(r.ok);
}

TEST_CASE("nn conv2d: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH((Conv2d<float>(store, "c", {.in = 1, .out = 1, .kernel = 2}, 1)),
                    "[conv2d] kernel must be odd where padding is not given, got 2");
  CHECK_THROWS_WITH(
      (Conv2d<float>(store, "c", {.in = 1, .out = 0}, 1)),
      "[conv2d] in, out, kernel and stride must be at least 1, got in 1, out 0, kernel 3 and stride 1");
  CHECK_THROWS_WITH((Conv2d<float>(store, "c", {.in = 1, .out = 1, .padding = -1}, 1)),
                    "[conv2d] padding must be at least 0, got -1");
}
