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
