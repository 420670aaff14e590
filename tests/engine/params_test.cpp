#include <fieldmark/engine/params.h>

#include <numeric>
#include <vector>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("params: one flat buffer, found by name and id") {
  ParamStore<float> store;
  const auto a = store.add("a/weight", {2, 3});
  const auto b = store.add("b", {4});
  CHECK(store.parameters() == 10);
  CHECK(store.entry(b).offset == 16);  // a cache line on
  CHECK(store.size() == 20);
  CHECK(store.find("a/weight").index == a.index);
  store.values(b)[0] = 7;
  CHECK(store.values()[16] == 7);
  CHECK_THROWS_WITH(store.add("b", {1}), "[params] name 'b' is already used");
  CHECK_THROWS_WITH(store.find("c"), "[params] there is no parameter 'c'");
}

TEST_CASE("params: gradients go to the store, to a shard, or nowhere") {
  ParamStore<float> store;
  store.add("a", {2});
  const auto b = store.add("b", {1});
  std::vector<float> shard(17);
  Tape<float> tape;
  Params<float>(store).leaf(tape, b).grad_acc()[0] += 1;
  Params<float>(store, shard.data()).leaf(tape, b).grad_acc()[0] += 2;
  CHECK(store.grads(b)[0] == 1);
  CHECK(shard[16] == 2);
  CHECK(std::accumulate(shard.begin(), shard.end(), 0.f) == 2);
  CHECK_FALSE(Params<float>(store, nullptr).leaf(tape, b).needs_grad());
  store.zero_grad();
  CHECK(store.grads()[16] == 0);
}
