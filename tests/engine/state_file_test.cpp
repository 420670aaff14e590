#include <fieldmark/engine/state_file.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

namespace {

struct Model {
  ParamStore<float> store;
  ParamId w = store.add("layer/weight", {3, 2}), mean = store.add("norm/mean", {2}, ParamRole::running);
  Adam<float> adam{store, {.lr = 0.01, .weight_decay = 0.1}};
  Sgd<float> sgd{store, {.momentum = 0.9}};
  Muon<float> muon{store, {"layer/*"}};

  explicit Model(unsigned seed) {
    const auto x = uniform<float>({store.size()}, -1, 1, seed);
    std::copy(x.data.begin(), x.data.end(), store.values().begin());
  }
  void step(auto& optimiser) {
    for (Index i = 0; i < store.size(); ++i)
      store.grads()[at(i)] = std::sin(3 * store.values()[at(i)] + static_cast<float>(i));
    optimiser.step(store.values(), store.grads());
  }
  std::vector<float> values() const { return {store.values().begin(), store.values().end()}; }
};

}  // namespace

TEST_CASE("state_file: training goes on with the same bits") {
  const TemporaryFolder folder;
  const auto expect_same_bits = [&](auto optimiser, const char* state) {
    CAPTURE(state);
    Model one(1), two(2);
    for (int i = 0; i < 3; ++i) one.step(one.*optimiser);
    SafetensorsFile file;
    save_state(file, "a/", one.store, one.*optimiser);
    save_state(file, "b/", two.store);
    file.write(folder / "state");
    const auto back = SafetensorsFile::read(folder / "state");
    CHECK(back.has("a/layer/weight"));
    CHECK(back.has(state));
    CHECK(back.has("b/norm/mean"));
    load_state(back, "a/", two.store, two.*optimiser);
    for (int i = 0; i < 3; ++i) {
      one.step(one.*optimiser);
      two.step(two.*optimiser);
    }
    CHECK(one.values() == two.values());
  };
  expect_same_bits(&Model::adam, "a/norm/mean.mean_square");
  expect_same_bits(&Model::sgd, "a/layer/weight.velocity");
  expect_same_bits(&Model::muon, "a/layer/weight.velocity");
}

TEST_CASE("state_file: errors leave everything as it was") {
  Model m(1);
  SafetensorsFile file;
  file.path = "model.safetensors";
  file.add("layer/weight", {3, 2}, std::span<const float>(std::vector<float>(6)));
  const auto before = m.values();
  CHECK_THROWS_WITH(load_state(file, "", m.store), Contains("model.safetensors") && Contains("norm/mean"));
  CHECK_THROWS_WITH(load_state(file, "", m.store, m.adam), Contains("adam/steps"));
  file.add("norm/mean", {1, 2}, std::span<const float>(std::vector<float>(2)));
  CHECK_THROWS_WITH(
      load_state(file, "", m.store),
      "model.safetensors: tensor 'norm/mean': expected shape [2] of F32, found shape [1, 2] of F32");
  CHECK(m.values() == before);
  ParamStore<double> wide;
  wide.add("layer/weight", {3, 2});
  CHECK_THROWS_WITH(load_state(file, "", wide),
                    Contains("expected shape [3, 2] of F64, found shape [3, 2] of F32"));
  Adam<float> small(3);
  CHECK_THROWS_WITH(save_state(file, "x/", m.store, small),
                    "[save_state] optimiser must be for the 8 elements of the store, got one for 3");
  CHECK_THROWS_WITH(load_state(file, "x/", m.store, small), Contains("adam/steps"));
  SafetensorsFile twice;
  save_state(twice, "", m.store);
  CHECK_THROWS_AS(save_state(twice, "", m.store), ValueError);
}
