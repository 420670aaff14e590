#include "peer_work.h"

#include <vector>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {

// Two layers of width 2 and one running statistic.
struct Layers {
  Layers() {
    store.add("0/weight", {2, 2});
    store.add("0/bias", {2});
    store.add("1/weight", {2, 2});
    store.add("1/bias", {2});
    const std::vector<float> values{1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0.5f, -2};
    std::copy(values.begin(), values.end(), store.values().begin());
  }
  ParamStore<float> store;
};

}  // namespace

TEST_CASE("peer_work: a work holds values, results and gradients by name, without running statistics") {
  ParamStore<float> store;
  store.add("0/weight", {1, 2});
  store.add("norm/running_mean", {2});
  store.values()[0] = 3;
  store.grads()[1] = 4;
  const std::vector<float> x{1, 2}, y{5};
  SafetensorsFile file = peer_work("net", store, {{1, 2}, {1}, x, y, y, x});
  CHECK(file.metadata.at("network") == "net");
  CHECK(file.metadata.at("parameters") == "0/weight");
  CHECK(file.metadata.at("draws") == "0");
  CHECK(file.f32("value/0/weight").data == std::vector<float>{3, 0});
  CHECK(file.f32("grad/0/weight").data == std::vector<float>{0, 4});
  CHECK(file.f32("dx").data == x);
  CHECK(file.f32("u").shape == Shape{1});
  CHECK_FALSE(file.has("value/norm/running_mean"));
  CHECK_FALSE(file.has("grad/norm/running_mean"));
}

TEST_CASE("peer_work: draws are counted, and lie beside one another") {
  Layers layers;
  const std::vector<float> x{1, 2};
  const PeerPass pass{{1, 2}, {1, 2}, x, x, x, x};
  SafetensorsFile file = peer_work("dense", layers.store, pass);
  add_draw(file, layers.store, pass);
  add_draw(file, layers.store, pass);
  CHECK(file.metadata.at("draws") == "2");
  CHECK(file.has("draw0/grad/1/bias"));
  CHECK(file.f32("draw1/x").data == x);
  CHECK_FALSE(file.has("draw2/x"));
}

TEST_CASE("peer_work: samples with a sum near a kink of any layer are left out, and only they") {
  const Layers layers;
  // Sums of the first layer are x. Those of the second are max(x, 0) + (0.5, -2).
  const std::vector<float> x{1, 3, 5e-6f, 3, -1, 2, 1, 2 + 5e-6f, -1, 2.1f};
  std::vector<float> u(x.size(), 7);
  leave_out_kinks(layers.store, {5, 2}, x, u);
  CHECK(u == std::vector<float>{7, 7, 0, 0, 0, 0, 0, 0, 7, 7});
}
