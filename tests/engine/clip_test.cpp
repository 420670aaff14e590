#include <fieldmark/engine/clip.h>
#include <fieldmark/engine/parallel.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;

TEST_CASE("clip: scales down to the limit, and never up") {
  std::vector<double> g{3, 0, -4};
  CHECK(grad_norm(std::span<const double>(g)) == 5);
  CHECK(clip_grad_norm(std::span(g), 10) == 5);
  CHECK(g == std::vector<double>{3, 0, -4});
  CHECK(clip_grad_norm(std::span(g), 1) == 5);
  CHECK(grad_norm(std::span<const double>(g)) == Approx(1).epsilon(1e-15));
  CHECK(g[2] == Approx(-0.8).epsilon(1e-15));
  std::vector<float> none;
  CHECK(clip_grad_norm(std::span(none), 1) == 0);
}

TEST_CASE("clip: a norm beyond double is clipped all the same") {
  std::vector<double> g{3e160, 0, -4e160};
  CHECK(clip_grad_norm(std::span(g), 1) == Approx(5e160).epsilon(1e-14));
  CHECK(g[0] == Approx(0.6).epsilon(1e-14));
  CHECK(g[2] == Approx(-0.8).epsilon(1e-14));
  std::vector<double> largest(4, std::numeric_limits<double>::max());
  CHECK(clip_grad_norm(std::span(largest), 2) == std::numeric_limits<double>::infinity());
  for (const double x : largest) CHECK(x == Approx(1).epsilon(1e-14));
  const std::vector<double> infinite{1, std::numeric_limits<double>::infinity()};
  CHECK(grad_norm(std::span(infinite)) == std::numeric_limits<double>::infinity());
}

TEST_CASE("clip: a store's gradients are one vector") {
  ParamStore<float> store;
  const ParamId a = store.add("a", {1}), b = store.add("net/b", {2});
  store.grads(a)[0] = 3;
  store.grads(b)[1] = 4;
  CHECK(clip_grad_norm(store, 0.5) == 5);
  CHECK(store.grads(a)[0] == Approx(0.3));
  CHECK(store.grads(b)[1] == Approx(0.4));
  store.grads(b)[1] = std::nanf("");
  CHECK_THROWS_WITH(clip_grad_norm(store, 1),
                    "[clip_grad_norm] gradients must be finite, got nan at element 1 of 'net/b'");
  CHECK(store.grads(a)[0] == Approx(0.3));
}

TEST_CASE("clip: same bits for any thread count") {
  const auto on = [](int threads) {
    const ScopedThreads scope(threads);
    auto g = uniform<float>({200001}, -1, 1, 1);
    clip_grad_norm(std::span(g.data), 1);
    return g.data;
  };
  CHECK(on(1) == on(2));
}

TEST_CASE("clip: errors") {
  std::vector<double> g{1, std::numeric_limits<double>::infinity()};
  CHECK_THROWS_WITH(clip_grad_norm(std::span(g), 1),
                    "[clip_grad_norm] gradients must be finite, got inf at element 1");
  CHECK_THROWS_WITH(clip_grad_norm(std::span(g), 0),
                    Contains("[clip_grad_norm] limit must be positive, got 0"));
  CHECK_THROWS_AS(clip_grad_norm(std::span(g), std::nan("")), ValueError);
}
