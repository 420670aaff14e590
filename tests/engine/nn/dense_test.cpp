#include <fieldmark/engine/nn/dense.h>

#include <algorithm>
#include <cmath>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

TEST_CASE("nn dense: registers its parameters and applies them") {
  ParamStore<double> store;
  const Dense<double> layer(store, "a", {.in = 2, .out = 3, .activation = Activation::relu}, 5);
  CHECK(store.entry(store.find("a/weight")).shape == Shape{2, 3});
  const auto w = store.values(store.find("a/weight"));
  for (double v : w) CHECK(std::abs(v) <= std::sqrt(3.0));
  store.values(store.find("a/bias"))[1] = -100;
  Tape<double> tape;
  const Tensor<double> x({1, 2}, {1, 2});
  const auto y = layer(Params<double>(store), tape.constant(x));
  CHECK(y.value()[0] == Approx(std::max(0.0, w[0] + 2 * w[3])));
  CHECK(y.value()[1] == 0);
}

TEST_CASE("nn dense: gradient in input and parameters") {
  ParamStore<double> store;
  const Dense<double> layer(store, "a", {.in = 3, .out = 4}, 5);
  const std::vector<Tensor<double>> x{uniform({5, 3}, -1, 1, 1)};
  const auto r = gradcheck_module([&](auto&, const auto& p, auto v) { return layer(p, v[0]); }, store, x);
  INFO(r.table);
  CHECK(r.ok);
  CHECK(r.entries == 15 + 16);
}

TEST_CASE("nn dense: without a bias it is a product") {
  ParamStore<double> store;
  const Dense<double> layer(store, "a", {.in = 2, .out = 3, .bias = false}, 5);
  CHECK(store.entries().size() == 1);
  const std::vector<Tensor<double>> x{uniform({5, 2}, -1, 1, 1)};
  const auto w = store.values();
  Tape<double> tape;
  const auto y = layer(Params<double>(store), tape.constant(x[0]));
  for (Index i = 0; i < 15; ++i)
    CHECK(y.value()[i] == Approx(x[0][i / 3 * 2] * w[at(i % 3)] + x[0][i / 3 * 2 + 1] * w[at(3 + i % 3)]));
  const auto r = gradcheck_module([&](auto&, const auto& p, auto v) { return layer(p, v[0]); }, store, x);
  INFO(r.table);
  CHECK(r.ok);
}

TEST_CASE("nn dense: parts give what the layer gives of their rows side by side") {
  for (const Index groups : {1, 3, 6}) {
    CAPTURE(groups);
    ParamStore<double> store;
    const Dense<double> layer(store, "a", {.in = 7, .out = 4, .activation = Activation::relu}, 5);
    const auto a = uniform({6, 2}, -1, 1, 1), b = uniform({groups, 3}, -1, 1, 2),
               c = uniform({6, 1}, -1, 1, 3), d = uniform({groups, 1}, -1, 1, 4);
    Tensor<double> whole({6, 7});
    for (Index i = 0; i < 6; ++i) {
      const Index g = i * groups / 6;
      const double row[] = {a[2 * i], a[2 * i + 1], b[3 * g], b[3 * g + 1], b[3 * g + 2], c[i], d[g]};
      std::copy(std::begin(row), std::end(row), &whole[7 * i]);
    }
    Tape<double> tape;
    const Params<double> params(store, nullptr);
    const std::vector<Var<double>> parts{tape.constant(a), tape.constant(b), tape.constant(c),
                                         tape.constant(d)};
    const auto y = layer(params, parts, 6), z = layer(params, tape.constant(whole));
    REQUIRE(y.shape() == z.shape());
    for (Index i = 0; i < 24; ++i) CHECK(y.value()[i] == Approx(z.value()[i]).margin(1e-14));
  }
}

TEST_CASE("nn dense: parts of no rows have no values") {
  ParamStore<float> store;
  const Dense<float> layer(store, "a", {.in = 40, .out = 24}, 5);
  const auto f = [&](auto&, auto v) { return layer(Params<float>(store), v, 0); };
  CHECK(op_values(f, std::vector{Tensor<float>({0, 32}), uniform<float>({1, 8}, -1, 1, 2)}).empty());
}

TEST_CASE("nn dense: parts have the same bits for 1 and 2 threads, with the gradients of the parameters") {
  const std::vector parts{uniform<float>({9000, 32}, -1, 1, 1), uniform<float>({3, 8}, -1, 1, 2)};
  const auto on = [&](int threads) {
    const ScopedThreads scope(threads);
    ParamStore<float> store;
    const Dense<float> layer(store, "a", {.in = 40, .out = 24, .activation = Activation::relu}, 5);
    auto result = run_op([&](auto&, auto v) { return layer(Params<float>(store), v, 9000); }, parts);
    result.emplace_back(store.grads().begin(), store.grads().end());
    return result;
  };
  CHECK(on(1) == on(2));
}

TEST_CASE("nn dense: errors") {
  ParamStore<float> store;
  const Dense<float> layer(store, "b", {.in = 5, .out = 4}, 1);
  Tape<float> tape;
  const Params<float> params(store, nullptr);
  const std::vector<float> zeros(30);
  const auto of = [&](Index rows, Index columns) { return tape.constant(zeros.data(), {rows, columns}); };
  const auto apply = [&](const std::vector<Var<float>>& parts) { return layer(params, parts, 6); };
  CHECK_THROWS_WITH(apply({}), "[dense] parts must include one of 6 rows");
  CHECK_THROWS_WITH(apply({of(2, 5)}), "[dense] parts must include one of 6 rows");
  CHECK_THROWS_WITH(apply({of(6, 3), of(4, 2)}),
                    "[dense] parts must have 6 rows, or all the same divisor of it, got shape [4, 2]");
  CHECK_THROWS_WITH(apply({of(6, 3), of(2, 1), of(3, 1)}),
                    "[dense] parts must have 6 rows, or all the same divisor of it, got shape [3, 1]");
  CHECK_THROWS_WITH(apply({of(6, 3), of(2, 1)}), "[dense] parts must have 5 columns together, got 4");
  CHECK_THROWS_WITH(apply({of(6, 3), of(2, 3)}), "[dense] parts must have 5 columns together, got 6");
  CHECK_THROWS_WITH((Dense<float>(store, "a", {.in = 0, .out = 4}, 1)),
                    "[dense] in and out must be at least 1, got in 0 and out 4");
}
