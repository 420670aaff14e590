#include <fieldmark/engine/nn/dense.h>

#include <cmath>

#include "support/expect_grad.h"

using namespace fieldmark;

TEST_CASE("nn dense: registers its parameters and applies them") {
  ParamStore<double> store;
  const Dense<double> layer(store, "a", {.in = 2, .out = 3, .activation = Activation::relu}, 5);
  CHECK(store.entry(store.find("a/weight")).shape == Shape{2, 3});
  const auto w = store.values(store.find("a/weight"));
  for (double v : w) CHECK(std::abs(v) <= std::sqrt(3.0));
  store.values(store.find("a/bias"))[1] = -100;
  Tape<double> tape;
  const Tensor<double> x({1, 2}, {1, 2});
  const auto y = layer(Params<double>(store), tape.constant(x));
  CHECK(y.value()[0] == Approx(std::max(0.0, w[0] + 2 * w[3])));
  CHECK(y.value()[1] == 0);
}

TEST_CASE("nn dense: gradient in input and parameters") {
  ParamStore<double> store;
  const Dense<double> layer(store, "a", {.in = 3, .out = 4}, 5);
  const std::vector<Tensor<double>> x{uniform({5, 3}, -1, 1, 1)};
  const auto r = gradcheck_module([&](auto&, const auto& p, auto v) { return layer(p, v[0]); }, store, x);
  INFO(r.table);
  CHECK(r.ok);
  CHECK(r.entries == 15 + 16);
}

TEST_CASE("nn dense: without a bias it is a product") {
  ParamStore<double> store;
  const Dense<double> layer(store, "a", {.in = 2, .out = 3, .bias = false}, 5);
  CHECK(store.entries().size() == 1);
  const std::vector<Tensor<double>> x{uniform({5, 2}, -1, 1, 1)};
  const auto w = store.values();
  Tape<double> tape;
  const auto y = layer(Params<double>(store), tape.constant(x[0]));
  for (Index i = 0; i < 15; ++i)
    CHECK(y.value()[i] == Approx(x[0][i / 3 * 2] * w[at(i % 3)] + x[0][i / 3 * 2 + 1] * w[at(3 + i % 3)]));
  const auto r = gradcheck_module([&](auto&, const auto& p, auto v) { return layer(p, v[0]); }, store, x);
  INFO(r.table);
  CHECK(r.ok);
}

TEST_CASE("nn dense: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH((Dense<float>(store, "a", {.in = 0, .out = 4}, 1)),
                    "[dense] in and out must be at least 1, got in 0 and out 4");
}
