#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/nn/layer_norm.h>
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

namespace {

// Two layers, of which the second has two parts.
struct TwoModules {
  ParamStore<float> store;
  Dense<float> first{store, "first", {.in = 3, .out = 2}, 1};
  LayerNorm<float> norm{store, "second/norm", 2};
  Dense<float> second{store, "second/dense", {.in = 2, .out = 4}, 2};
  Adam<float> adam{store};
  Sgd<float> sgd{store, {.momentum = 0.9}};

  explicit TwoModules(unsigned seed) {
    for (const std::span<float> all : {store.values(), adam.mean(), adam.mean_square(), sgd.velocity()})
      std::ranges::copy(uniform<float>({store.size()}, 0, 1, seed++).data, all.begin());
  }
  // Values of the store or its optimisers: those of "second", or of the others.
  std::vector<float> of_second(std::span<const float> all, bool wanted = true) const {
    std::vector<float> some;
    for (const auto& e : store.entries())
      if (e.name.starts_with("second/") == wanted)
        for (Index i = 0; i < e.shape.size(); ++i) some.push_back(all[at(e.offset + i)]);
    return some;
  }
};

}  // namespace

TEST_CASE("state_file: one module of two goes into another store and leaves the rest as it was") {
  TwoModules one(1), two(10);
  const TwoModules before(10);
  SafetensorsFile file;
  save_state(file, "kept/", one.store, "second");
  CHECK(file.has("kept/norm/gamma"));
  CHECK(file.has("kept/dense/weight"));
  CHECK(file.tensors.size() == 4);
  load_state(file, "kept/", two.store, "second");
  CHECK(two.of_second(two.store.values()) == one.of_second(one.store.values()));
  CHECK(two.of_second(two.store.values(), false) == before.of_second(before.store.values(), false));
  CHECK(std::ranges::equal(two.adam.mean(), before.adam.mean()));

  // Under another name, and out of the state of a whole store.
  ParamStore<float> other;
  const Dense<float> layer(other, "decoder/last", {.in = 2, .out = 4}, 5);
  const std::span<const float> weight = one.store.values(one.store.find("second/dense/weight"));
  load_state(file, "kept/dense/", other, "decoder/last");
  CHECK(std::ranges::equal(other.values(other.find("decoder/last/weight")), weight));
  SafetensorsFile whole;
  save_state(whole, "model/", one.store);
  std::ranges::fill(other.values(), 0.f);
  load_state(whole, "model/second/dense/", other, "decoder/last");
  CHECK(std::ranges::equal(other.values(other.find("decoder/last/weight")), weight));
}

TEST_CASE("state_file: a module takes along its part of the optimiser's state, but not Adam's steps") {
  TwoModules one(1), two(10);
  const TwoModules before(10);
  one.adam.set_steps(7);
  two.adam.set_steps(3);
  SafetensorsFile file;
  save_state(file, "adam/", one.store, one.adam, "second");
  save_state(file, "sgd/", one.store, one.sgd, "second");
  CHECK_FALSE(file.has("adam/adam/steps"));
  CHECK(file.has("adam/norm/beta.mean_square"));
  CHECK(file.has("sgd/norm/beta.velocity"));
  load_state(file, "adam/", two.store, two.adam, "second");
  load_state(file, "sgd/", two.store, two.sgd, "second");
  CHECK(two.adam.steps() == 3);
  const auto expect_second_alone = [&](auto part) {
    CHECK(two.of_second(part(two)) == one.of_second(part(one)));
    CHECK(two.of_second(part(two), false) == before.of_second(part(before), false));
  };
  expect_second_alone([](const TwoModules& m) { return m.store.values(); });
  expect_second_alone([](const TwoModules& m) { return m.adam.mean(); });
  expect_second_alone([](const TwoModules& m) { return m.adam.mean_square(); });
  expect_second_alone([](const TwoModules& m) { return m.sgd.velocity(); });
}

TEST_CASE("state_file: errors of a module name it or its array, and leave everything as it was") {
  TwoModules m(1);
  const std::vector<float> before(m.store.values().begin(), m.store.values().end());
  SafetensorsFile file;
  file.path = "model.safetensors";
  CHECK_THROWS_WITH(save_state(file, "", m.store, "third"),
                    "[save_state] the store has no parameter of the module 'third'");
  CHECK_THROWS_WITH(load_state(file, "", m.store, "sec"),
                    "[load_state] the store has no parameter of the module 'sec'");
  CHECK(file.tensors.empty());
  file.add("a/weight", {3, 2}, std::span<const float>(std::vector<float>(6)));
  CHECK_THROWS_WITH(load_state(file, "a/", m.store, "first"),
                    Contains("model.safetensors") && Contains("a/bias"));
  file.add("a/bias", {3}, std::span<const float>(std::vector<float>(3)));
  CHECK_THROWS_WITH(load_state(file, "a/", m.store, "first"),
                    "model.safetensors: tensor 'a/bias': expected shape [2] of F32, found shape [3] of F32");
  CHECK_THROWS_WITH(load_state(file, "a/", m.store, m.adam, "first"), Contains("a/weight.mean"));
  CHECK(std::ranges::equal(m.store.values(), before));
  Adam<float> small(3);
  CHECK_THROWS_AS(load_state(file, "a/", m.store, small, "first"), ShapeError);
  save_state(file, "b/", m.store, "first");
  CHECK_THROWS_AS(save_state(file, "b/", m.store, "first"), ValueError);
}
