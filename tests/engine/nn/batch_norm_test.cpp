#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/nn/batch_norm.h>

#include "support/expect_grad.h"

using namespace fieldmark;

TEST_CASE("nn/batch_norm: running statistics lead from the initial ones to the batch's") {
  ParamStore<double> store;
  const BatchNorm<double> norm(store, "n", 2);
  const auto mean = store.values(store.find("n/running_mean"));
  const auto variance = store.values(store.find("n/running_variance"));
  CHECK((mean[1] == 0 && variance[1] == 1));
  const auto x = uniform({2, 3, 3, 2}, 1, 5, 1);
  Tape<double> tape;
  BatchStatistics seen;
  const auto trained = norm(Params<double>(store), tape.constant(x), &seen);
  norm.update(store, seen, 0.25);
  CHECK(mean[1] == 0.25 * seen.mean[1]);
  CHECK(variance[1] == 0.75 + 0.25 * seen.variance[1]);
  norm.update(store, seen, 1);
  const auto tested = norm.evaluate(Params<double>(store), tape.constant(x));
  for (Index i = 0; i < x.size(); ++i) CHECK(tested.value()[i] == trained.value()[i]);
}

TEST_CASE("nn/batch_norm: the running statistics are not trained: weight decay leaves them alone") {
  ParamStore<float> store;
  const BatchNorm<float> norm(store, "n", 2);
  Adam<float> adam(store, {.lr = 0.1, .weight_decay = 1});
  adam.step(store.values(), store.grads());
  CHECK(store.values(store.find("n/gamma"))[0] == Approx(0.9));
  CHECK(store.values(store.find("n/running_variance"))[0] == 1);
}

TEST_CASE("nn/batch_norm: gradient") {
  ParamStore<double> store;
  const BatchNorm<double> norm(store, "n", 3);
  const Tensor<double> inputs[] = {uniform({2, 2, 3, 3}, -1, 1, 1)};
  const auto report = gradcheck_module(
      [&](Tape<double>&, const Params<double>& p, std::span<const Var<double>> v) { return norm(p, v[0]); },
      store, inputs);
  INFO(report.table);
  CHECK(report.ok);
}

TEST_CASE("nn/batch_norm: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH(BatchNorm<float>(store, "n", 0), "[BatchNorm] channels must be at least 1, got 0");
  const BatchNorm<float> norm(store, "n", 2);
  CHECK_THROWS_WITH(norm.update(store, {{0, 0}, {1, 1}}, 1.5),
                    Contains("momentum must be in [0, 1], got 1.5"));
  CHECK_THROWS_WITH(norm.update(store, {{0}, {1}}), "[BatchNorm] batch must have 2 channels, got 1");
}
