#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/packed_weights.h>

#include <algorithm>

#include "support/bf16.h"
#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
// Values, dX and parameter gradients of one layer, with and without packed weights.
template <class T>
std::vector<T> pass(const Dense<T>& layer, const ParamStore<T>& store, const PackedWeights<T>* packed,
                    const Tensor<T>& x) {
  std::vector<T> grads(static_cast<std::size_t>(store.size()));
  Tensor<T> dx(x.shape);
  Tape<T> tape;
  const Params<T> params = packed ? Params<T>(store, grads.data(), *packed) : Params<T>(store, grads.data());
  const Var<T> y = layer(params, tape.leaf(x, dx));
  tape.backward(y, uniform<T>(y.shape(), -1, 1, 9).data);
  std::vector<T> all(y.value(), y.value() + y.shape().size());
  all.insert(all.end(), dx.data.begin(), dx.data.end());
  all.insert(all.end(), grads.begin(), grads.end());
  return all;
}

template <class T>
void same_for_all_widths() {
  for (Index width : {1, 3, 4, 15, 16, 17, 31, 33, 48, 63, 64, 65, 80, 127, 130}) {
    for (Index out : {width, Index{7}}) {
      ParamStore<T> store;
      const Dense<T> layer(store, "layer", {.in = width, .out = out, .activation = Activation::relu}, 3);
      PackedWeights<T> packed(store);
      packed.update();
      const auto x = uniform<T>({9, width}, -1, 1, 4);
      CAPTURE(width, out);
      REQUIRE(pass(layer, store, &packed, x) ==
              pass(layer, store, static_cast<PackedWeights<T>*>(nullptr), x));
    }
  }
}
}  // namespace

TEST_CASE("packed_weights: a layer gives the same bits with them as without") {
  each_isa([] {
    same_for_all_widths<float>();
    same_for_all_widths<double>();
  });
}

TEST_CASE("packed_weights: update takes the present values, for matrices of layers only") {
  ParamStore<float> store;
  const Dense<float> layer(store, "layer", {.in = 5, .out = 6}, 3);
  const ParamId table = store.add("table", {8, 4});
  PackedWeights<float> packed(store);
  packed.update();
  CHECK(packed.find(table) == nullptr);
  CHECK(packed.find(store.find("layer/bias")) == nullptr);
  REQUIRE(packed.find(store.find("layer/weight")) != nullptr);
  const auto x = uniform<float>({3, 5}, -1, 1, 4);
  const auto before = pass(layer, store, &packed, x);
  for (float& v : store.values()) v *= 2;
  CHECK_THROWS_WITH(pass(layer, store, &packed, x),
                    "[packed_weights] 'layer/weight' has other values than when it was packed: call update() "
                    "after every step");
  packed.update();
  CHECK(pass(layer, store, &packed, x) == pass<float>(layer, store, nullptr, x));
  CHECK(pass(layer, store, &packed, x) != before);
}

TEST_CASE("packed_weights: another instruction set and parameters added later are errors") {
  ParamStore<float> store;
  const Dense<float> layer(store, "layer", {.in = 5, .out = 6}, 3);
  PackedWeights<float> packed(store);
  CHECK(packed.find(store.find("layer/weight")) == nullptr);  // nothing is packed yet
  packed.update();
  if (isa() != Isa::v2) {
    const ScopedIsa scope(Isa::v2);
    CHECK_THROWS_WITH(packed.find(store.find("layer/weight")),
                      "[packed_weights] weights were packed for another instruction set than v2: call "
                      "update() after a change of it");
  }
  CHECK(packed.find(store.find("layer/weight")) != nullptr);
  const ParamId late = store.add("late/weight", {2, 2});
  CHECK_THROWS_WITH(packed.find(late),
                    "[packed_weights] id must be one of the 2 parameters that the store had when its weights "
                    "were first packed, got 2");
  CHECK_THROWS_AS(packed.table(late), ValueError);
  CHECK_THROWS_AS(packed.find(ParamId{}), ValueError);
  CHECK_THROWS_WITH(packed.update(), Contains("the store has 3 parameters, it had 2"));
}

TEST_CASE("packed_weights: in bf16 a layer's values and gradients are off by the rounding, dW by less") {
  ParamStore<float> store;
  const Dense<float> layer(store, "layer", {.in = 33, .out = 40}, 3);
  if (!bf16_or_skip("packed_weights: a layer in bf16")) {
    CHECK_THROWS_WITH((PackedWeights<float>(store, {.precision = Precision::bf16})),
                      Contains("no bf16 products"));
    return;
  }
  PackedWeights<float> packed(store, {.precision = Precision::bf16});
  packed.update();
  const auto x = uniform<float>({70, 33}, -1, 1, 4);
  const auto got = pass(layer, store, &packed, x),
             want = pass(layer, store, static_cast<PackedWeights<float>*>(nullptr), x);
  const std::size_t y = 70 * 40, dx = y + 70 * 33;
  const auto worst = [&](std::size_t begin, std::size_t end) {
    double error = 0, largest = 0;
    for (std::size_t i = begin; i < end; ++i) {
      raise_to(error, static_cast<double>(std::abs(got[i] - want[i])));
      raise_to(largest, std::abs(static_cast<double>(want[i])));
    }
    return error / largest;
  };
  CHECK(worst(0, y) > 1e-5);  // shows that rounding took place
  CHECK(worst(0, y) < 4e-3);
  CHECK(worst(y, dx) < 4e-3f);
  CHECK(worst(dx, want.size()) == 0);  // dW is computed from float numbers
}

TEST_CASE("packed_weights: tables are rounded on request") {
  ParamStore<float> store;
  const ParamId table = store.add("hash/table", {3, 4}, ParamRole::table);
  store.values(table)[5] = 1.00390625f;
  PackedWeights<float> plain(store);
  plain.update();
  CHECK(plain.table(table) == nullptr);
  if (!bf16_or_skip("packed_weights: tables in bf16")) return;
  PackedWeights<float> packed(store, {.precision = Precision::bf16, .tables = true});
  packed.update();
  REQUIRE(packed.table(table));
  CHECK(packed.table(table)[5] == 0x3f80);
  CHECK(packed.table(table)[4] == 0);
  store.values(table)[11] = 2;
  CHECK_THROWS_WITH(packed.table(table), Contains("'hash/table' has other values"));
  ParamStore<double> exact;
  CHECK_THROWS_WITH((PackedWeights<double>(exact, {.precision = Precision::bf16})),
                    Contains("not for double"));
}
