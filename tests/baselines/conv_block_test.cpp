#include "conv_block.h"
#include <fieldmark/engine/ops/batch_norm.h>
#include <fieldmark/engine/ops/conv2d.h>

#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

TEST_CASE("conv_block: the ops it is made of, and running statistics that follow the batches") {
  ParamStore<float> store;
  const ConvBlock<float> block(store, "b", 3, 4, 1);
  const auto x = uniform<float>({2, 6, 5, 3}, -1, 1, 1);
  const Params<float> params(store, nullptr);
  Tape<float> tape;
  NormPass<float> pass;
  const auto y = block(params, tape.constant(x), pass);
  const auto sums = conv2d(tape.constant(x), params.leaf(tape, store.find("b/conv/weight")),
                           params.leaf(tape, store.find("b/conv/bias")));
  const auto expected = batch_norm(sums, params.leaf(tape, store.find("b/norm/gamma")),
                                   params.leaf(tape, store.find("b/norm/beta")), {.relu = true});
  for (Index i = 0; i < y.shape().size(); ++i) CHECK(y.value()[i] == expected.value()[i]);
  REQUIRE(pass.seen.size() == 1);
  update_statistics(store, pass, 1.0);
  NormPass<float> running{.running = true};
  const auto same = block(params, tape.constant(x), running);
  CHECK(running.seen.empty());
  for (Index i = 0; i < y.shape().size(); ++i)
    CHECK(same.value()[i] == Approx(y.value()[i]).margin(1e-5));  // measured: 4e-7, sums in another order
}

TEST_CASE("conv_block: without ReLU there are negative numbers, and the same bits on one and two threads") {
  ParamStore<float> store;
  const ConvBlock<float> block(store, "b", 3, 8, 1, false);
  const auto x = uniform<float>({2, 33, 31, 3}, -1, 1, 1);
  const auto run = [&](auto&, auto v) {
    NormPass<float> pass;
    return block(Params<float>(store, nullptr), v[0], pass);
  };
  const auto y = op_values<float>(run, {x});
  CHECK(std::any_of(y.begin(), y.end(), [](float v) { return v < 0; }));
  expect_same_bits(run, {x});
  CHECK_THROWS_AS(ConvBlock<float>(store, "b", 3, 8, 1), ValueError);
}
