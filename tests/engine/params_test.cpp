#include <fieldmark/engine/nn/batch_norm.h>
#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/nn/group_norm.h>
#include <fieldmark/engine/nn/layer_norm.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/packed_weights.h>
#include <fieldmark/engine/params.h>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("params: one flat buffer, found by name and id") {
  ParamStore<float> store;
  const auto a = store.add("a/weight", {2, 3});
  const auto b = store.add("b", {4});
  CHECK(store.size() == 10);
  CHECK(store.entry(b).offset == 6);
  CHECK(store.find("a/weight").index == a.index);
  store.values(b)[0] = 7;
  CHECK(store.values()[6] == 7);
  CHECK_THROWS_WITH(store.add("b", {1}), "[params] name 'b' is already used");
  CHECK_THROWS_WITH(store.find("c"), "[params] there is no parameter 'c'");
}

TEST_CASE("params: patterns match whole names, and a star crosses slashes") {
  CHECK(name_matches("extractor/*weight", "extractor/down0/conv/weight"));
  CHECK(name_matches("*", ".hidden/w"));
  CHECK(name_matches("a*", "a"));
  CHECK(name_matches("w[01]", "w1"));
  CHECK_FALSE(name_matches("extractor", "extractor/w"));
  CHECK_FALSE(name_matches("*bias", "bias/w"));
  CHECK_FALSE(name_matches("", "w"));
}

TEST_CASE("params: gradients go to the store, to a shard, or nowhere") {
  ParamStore<float> store;
  store.add("a", {2});
  const auto b = store.add("b", {1});
  std::vector<float> shard(3);
  Tape<float> tape;
  Params<float>(store).leaf(tape, b).grad_acc()[0] += 1;
  Params<float>(store, shard.data()).leaf(tape, b).grad_acc()[0] += 2;
  CHECK(store.grads(b)[0] == 1);
  CHECK(shard == std::vector<float>{0, 0, 2});
  CHECK_FALSE(Params<float>(store, nullptr).leaf(tape, b).needs_grad());
  store.zero_grad();
  CHECK(store.grads()[2] == 0);
}

TEST_CASE("params: running values are read, and get no gradient") {
  ParamStore<float> store;
  const auto weight = store.add("w", {2}), mean = store.add("mean", {2}, ParamRole::running);
  CHECK(store.entry(weight).role == ParamRole::trained);
  CHECK(store.entry(mean).role == ParamRole::running);
  Tape<float> tape;
  CHECK(Params<float>(store).leaf(tape, weight).needs_grad());
  const Var<float> v = Params<float>(store).leaf(tape, mean);
  CHECK_FALSE(v.needs_grad());
  CHECK(v.value() == store.values(mean).data());
}

TEST_CASE("params: computed parameters pass gradients on, in each backward, running ones stay the store's") {
  ParamStore<double> store;
  const auto a = store.add("a", {2}), mean = store.add("mean", {1}, ParamRole::running),
             b = store.add("b", {1});
  store.values(mean)[0] = 5;
  const Tensor<double> theta({4}, std::vector<double>{1, 2, 3, 4});
  Tensor<double> g({4});
  Tape<double> tape;
  const Var<double> all = tape.reshape(tape.leaf(theta, g), {4});
  const Params<double> params(store, all);
  const Var<double> y = mul(params.leaf(tape, a), params.leaf(tape, a)), z = params.leaf(tape, b);
  CHECK(params.leaf(tape, mean).value()[0] == 5);
  CHECK(z.value()[0] == 4);
  for (int times : {1, 2}) {
    tape.backward(y, std::vector<double>{1, 1});
    tape.backward(z);
    CHECK(g.data == std::vector<double>{2. * times, 4. * times, 0, 1. * times});
  }
  CHECK_THROWS_WITH(Params<double>(store, z),
                    "[params] all must have the 4 elements of the store, got shape [1]");
}

TEST_CASE("params: a store that grew refuses Params of before, whose pointers dangle") {
  ParamStore<float> store;
  const auto a = store.add("a", {2});
  Tape<float> tape;
  const Params<float> params(store), inference(store, nullptr);
  CHECK(params.leaf(tape, a).shape() == Shape{2});
  const auto b = store.add("b", {0});
  for (const Params<float>& p : {params, inference})
    for (const ParamId id : {a, b})
      CHECK_THROWS_WITH(
          p.leaf(tape, id),
          "[params] the store has other buffers than when these Params were made: make them after "
          "the last add()");
  CHECK(Params<float>(store).leaf(tape, b).shape() == Shape{0});
  const Params<float> again(store);
  store = ParamStore<float>(store);
  CHECK_THROWS_AS(again.leaf(tape, a), ValueError);
}

TEST_CASE("params: a tensor without memory and a layer without all its names leave the store as it was") {
  ParamStore<float> store;
  store.add("a/bias", {2});
  CHECK_THROWS(store.add("huge", {Index{1} << 60}));
  CHECK(store.entries().size() == 1);
  CHECK(store.values().size() == 2);
  CHECK(store.grads().size() == 2);
  CHECK_THROWS_WITH(Dense<float>(store, "a", {.in = 2, .out = 2}, 1),
                    "[params] name 'a/bias' is already used");
  CHECK_THROWS_WITH(Conv2d<float>(store, "a", {.in = 2, .out = 2}, 1), Contains("'a/bias' is already used"));
  store.add("n/beta", {2});
  CHECK_THROWS_WITH(LayerNorm<float>(store, "n", 2), Contains("'n/beta' is already used"));
  CHECK_THROWS_WITH(GroupNorm<float>(store, "n", 2, {.groups = 1}), Contains("'n/beta' is already used"));
  CHECK_THROWS_WITH(BatchNorm<float>(store, "n", 2, {}), Contains("'n/beta' is already used"));
  CHECK(store.entries().size() == 2);
}

TEST_CASE("params: packed weights of another store are refused") {
  ParamStore<float> a, b;
  const Dense<float> of_a(a, "l", {.in = 4, .out = 4}, 1), of_b(b, "l", {.in = 4, .out = 4}, 2);
  PackedWeights<float> packed(a);
  packed.update();
  CHECK_NOTHROW(Params<float>(a, nullptr, packed));
  CHECK_THROWS_WITH(Params<float>(b, nullptr, packed), "[params] packed must be of the same store");
}

TEST_CASE("params: ids that the store has not are errors") {
  ParamStore<double> store;
  store.add("a", {2});
  CHECK_THROWS_WITH(store.entry({1}), "[params] an id must be below the 1 parameters of the store, got 1");
  CHECK_THROWS_WITH(store.values({-1}), Contains("got -1"));
  CHECK_THROWS_AS(store.grads({7}), ValueError);
  Tape<double> tape;
  CHECK_THROWS_AS(Params<double>(store).leaf(tape, ParamId{}), ValueError);
}

namespace {
template <class T>
void check_gap() {
  ParamStore<T> store;
  store.add("small", {3});
  const auto large = store.add("large", {4096});
  const auto next = store.add("next", {1});
  CHECK(store.entry(large).offset == 16);
  CHECK(store.entry(next).offset == 16 + 4096);
  CHECK(store.size() == 16 + 4096 + 1);
  CHECK(store.parameters() == 3 + 4096 + 1);
}
}  // namespace

TEST_CASE("params: a large tensor starts on a cache line, at the same place for float and double") {
  check_gap<float>();
  check_gap<double>();
}
