#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/sgd.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;

TEST_CASE("sgd: steps by hand") {
  const auto run = [](SgdOptions o, int steps) {
    Sgd<double> sgd(1, o);
    std::vector<double> x{1}, g{2};
    for (int i = 0; i < steps; ++i) sgd.step(x, g);
    return x[0];
  };
  CHECK(run({.lr = 0.1}, 3) == Approx(1 - 3 * 0.2).epsilon(1e-15));
  // u = 2, 3, 3.5 with momentum 1/2.
  CHECK(run({.lr = 0.1, .momentum = 0.5}, 3) == Approx(1 - 0.1 * 8.5).epsilon(1e-15));
  CHECK(run({.lr = 0.1, .momentum = 0.5, .nesterov = true}, 2) == Approx(1 - 0.1 * (3 + 3.5)).epsilon(1e-15));
  CHECK(run({.lr = 0.1, .weight_decay = 0.5}, 1) == Approx(1 - 0.1 * 2.5).epsilon(1e-15));
}

TEST_CASE("sgd: running values of a store stay") {
  ParamStore<float> store;
  const ParamId w = store.add("w", {2}), mean = store.add("mean", {2}, ParamRole::running),
                b = store.add("b", {1});
  std::fill(store.values().begin(), store.values().end(), 1.f);
  std::fill(store.grads().begin(), store.grads().end(), 1.f);
  Sgd<float> sgd(store, {.lr = 0.5, .weight_decay = 1});
  sgd.step(store.values(), store.grads(), 0.5);
  CHECK(store.values(w)[1] == 0.5f);
  CHECK(store.values(b)[0] == 0.5f);
  CHECK(store.values(mean)[0] == 1);
}

TEST_CASE("sgd: same bits for any thread count") {
  const auto on = [](int threads) {
    const ScopedThreads scope(threads);
    auto x = uniform<float>({100001}, -1, 1, 1), g = uniform<float>({100001}, -1, 1, 2);
    Sgd<float> sgd(x.size(), {.momentum = 0.9, .nesterov = true});
    for (int i = 0; i < 3; ++i) sgd.step(x.data, g.data);
    return x.data;
  };
  CHECK(on(1) == on(2));
}

TEST_CASE("sgd: errors") {
  CHECK_THROWS_WITH(Sgd<float>(1, {.lr = 0}), Contains("[Sgd] lr must be positive, got 0"));
  CHECK_THROWS_WITH(Sgd<float>(1, {.momentum = 1}), Contains("[Sgd] momentum must be in [0, 1), got 1"));
  CHECK_THROWS_AS(Sgd<float>(1, {.momentum = std::nan("")}), ValueError);
  CHECK_THROWS_WITH(Sgd<float>(1, {.weight_decay = -1}), Contains("weight_decay must be at least 0"));
  CHECK_THROWS_WITH(Sgd<float>(-1), Contains("[Sgd] n must be at least 0"));
  Sgd<float> sgd(2);
  std::vector<float> two(2), three(3);
  CHECK_THROWS_WITH(sgd.step(three, two), "[Sgd::step] values must have 2 elements, as the optimiser, got 3");
  CHECK_THROWS_WITH(sgd.step(two, three), Contains("[Sgd::step] grads must have 2 elements"));
}
