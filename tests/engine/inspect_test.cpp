#include <fieldmark/engine/inspect.h>
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/reduce_axes.h>

#include <cmath>
#include <optional>

#include "support/catch.h"

using namespace fieldmark;

namespace {

const Tensor<double> kSmall({2, 2}, {1, 2, 3, 4});

// An op whose backward turns finite values into an infinity.
Var<double> broken(Var<double> x) {
  double* y = nullptr;
  const Var<double> out = x.tape().output(x.shape(), &y, {x});
  std::copy_n(x.value(), x.shape().size(), y);
  x.tape().on_backward(out, [x](const double* dy) {
    double* dx = x.grad_acc();
    for (Index i = 0; i < x.shape().size(); ++i) dx[i] += i == 2 ? dy[i] / 0.0 : dy[i];
  });
  return out;
}

}  // namespace

TEST_CASE("inspect: the graph as text and as DOT, with names") {
  Tape<double> tape;
  TapeInspector<double> inspector(tape);
  Tensor<double> g({2, 2});
  const auto x = tape.name(tape.leaf(kSmall, g), "x");
  const auto y = tape.name(x * x, "say \"square\"");
  const auto loss = mse_loss(sum(y, {0}), tape.reshape(sum(y, {1}), {2}));
  const std::string text = inspector.text(), dot = inspector.dot();
  INFO(text << dot);
  CHECK_THAT(text, Contains("0      x                 input"));
  CHECK_THAT(text, Contains("mul (arithmetic.cpp:"));
  CHECK_THAT(text, Contains("[2, 2]            0 0\n"));
  CHECK_THAT(text, Contains("mse_loss (loss.cpp:"));
  CHECK_THAT(dot, Contains("n0 [label=\"x: input\\n[2, 2]\", style=rounded];"));
  CHECK_THAT(dot, Contains("n1 [label=\"say \\\"square\\\": mul\\n[2, 2]\"];"));
  CHECK_THAT(dot, Contains("n0 -> n1;"));
  CHECK_THAT(dot, Contains("digraph tape {"));
  tape.backward(loss);
  tape.reset();
  CHECK(inspector.dot() == "digraph tape {\n  node [shape=box];\n}\n");
}

TEST_CASE("inspect: results are those without an inspector") {
  const auto run = [](bool inspected) {
    Tape<double> tape;
    std::optional<TapeInspector<double>> inspector;
    if (inspected) inspector.emplace(tape, InspectOptions{.stop_at_nonfinite = true});
    Tensor<double> g({2, 2});
    const auto x = tape.leaf(kSmall, g);
    tape.backward(sum(log(x * x + 1) / x));
    return g.data;
  };
  CHECK(run(true) == run(false));
}

TEST_CASE("inspect: the op that makes the first NaN or infinity is named, forward and backward") {
  Tape<double> tape;
  TapeInspector<double> inspector(tape, {.stop_at_nonfinite = true});
  Tensor<double> g({2, 2});
  const auto x = tape.name(tape.leaf(kSmall, g), "x");
  const auto shifted = x - 3;
  CHECK_THROWS_WITH(log(shifted),
                    Contains("[inspect] log (math.cpp:") &&
                        Contains(") made the first NaN, in value 2, shape [2, 2], at element 0"));
  tape.reset();
  const auto z = tape.name(tape.leaf(kSmall, g), "z");
  CHECK_THROWS_WITH(1 / (z - 2), Contains("reciprocal (") && Contains("made the first infinity, in value 2"));
  tape.reset();
  const auto w = tape.name(tape.leaf(kSmall, g), "w");
  CHECK_THROWS_WITH(
      tape.backward(sum(broken(w))),
      Contains("[inspect] the backward of broken (inspect_test.cpp:") &&
          Contains("made the first infinity, in the gradient of value 0 'w', shape [2, 2], at element 2"));
  tape.reset();
  Tensor<double> bad({2, 2}, 1.0);
  bad[3] = std::nan("");
  const auto b = tape.name(tape.constant(bad), "weights");
  CHECK_THROWS_WITH(b * 2,
                    Contains("[inspect] input value 0 'weights', shape [2, 2], holds NaN at element 3, which "
                             "scale ("));
  tape.reset();
  Tensor<double> g_clean({2, 2});
  const auto y = tape.leaf(kSmall, g_clean) * 2;
  CHECK_THROWS_WITH(tape.backward(y, std::vector<double>{1, 1, std::nan(""), 1}),
                    Contains("[inspect] the backward began with NaN in the gradient of value 1"));
  tape.reset();
  CHECK_THROWS_WITH(
      tape.leaf(kSmall, bad) * 2,
      "[inspect] the gradient buffer of value 0, shape [2, 2], holds NaN at element 3 before the "
      "backward");
}

TEST_CASE("inspect: time and memory by op") {
  Tape<float> tape;
  TapeInspector<float> inspector(tape);
  const Tensor<float> x({64, 32}, 0.5f), w({32, 32}, 0.1f), b({32});
  Tensor<float> dw({32, 32}), db({32});
  for (int pass = 0; pass < 3; ++pass) {
    tape.reset();
    tape.backward(sum(dense(tape.constant(x), tape.leaf(w, dw), tape.leaf(b, db))));
  }
  const auto costs = inspector.costs();
  REQUIRE(costs.size() == 2);
  const OpCost& c = costs[0].op == "dense" ? costs[0] : costs[1];
  CHECK(c.op == "dense");
  CHECK(c.calls == 3);
  CHECK(c.forward_bytes >= 3 * 64 * 32 * 4);
  CHECK(c.forward_seconds > 0);
  CHECK(c.backward_seconds > 0);
  CHECK_THAT(inspector.cost_table(), Contains("dense ") && Contains("sum "));
}

TEST_CASE("inspect: statistics of named values and gradients, over passes") {
  Tape<double> tape;
  TapeInspector<double> inspector(tape, {.statistics = true});
  ParamStore<double> store;
  const ParamId w = store.add("w", {2}), unused = store.add("unused", {3});
  store.values(w)[0] = 3;
  store.values(w)[1] = -4;
  const Tensor<double> x({2}, {0, 2});
  for (int pass = 0; pass < 2; ++pass) {
    tape.reset();
    store.zero_grad();
    const Params<double> params(store);
    const auto weights = params.leaf(tape, w);
    params.leaf(tape, unused);
    // w feeds two ops, whose gradients arrive one after the other: x and 1 times the gradient of y.
    const auto y = tape.name(weights * tape.name(tape.constant(x), "x") + weights, "y");
    tape.backward(sum(y * y));
  }
  const auto grads = inspector.gradient_stats();
  INFO(stats_table(grads));
  REQUIRE(grads.size() == 2);  // no gradients of constants or of unreached values
  // y = (3, -12), dL/dy = 2 y = (6, -24), dL/dw = dL/dy (x + 1) = (6, -72).
  CHECK((grads[0].name == "w" && grads[0].count == 4 && grads[0].mean == -33 && grads[0].largest == 72));
  CHECK(grads[0].rms == Approx(std::sqrt(2610.0)).epsilon(1e-15));
  CHECK((grads[1].name == "y" && grads[1].count == 4 && grads[1].mean == -9 && grads[1].largest == 24));
  const auto values = inspector.value_stats();
  REQUIRE(values.size() == 4);
  CHECK((values[0].name == "w" && values[0].count == 4 && values[0].mean == -0.5 && values[0].largest == 4));
  CHECK((values[1].name == "unused" && values[1].count == 6 && values[1].zero_fraction() == 1));
  CHECK((values[2].name == "x" && values[2].zero_fraction() == 0.5));
  CHECK((values[3].name == "y" && values[3].largest == 12));
}

TEST_CASE("inspect: of several backwards in a pass the last counts, and NaN are only counted") {
  Tape<double> tape;
  TapeInspector<double> inspector(tape, {.statistics = true});
  Tensor<double> g({2, 2});
  const auto x = tape.name(tape.leaf(kSmall, g), "x");
  const auto y = tape.name(broken(x), "y");
  const auto total = sum(y);
  tape.backward(total);
  tape.backward(total);
  const auto grads = inspector.gradient_stats();
  REQUIRE(grads.size() == 2);
  CHECK((grads[0].name == "x" && grads[0].count == 4 && grads[0].nonfinite == 1 && grads[0].mean == 2));
  CHECK((grads[1].name == "y" && grads[1].count == 4 && grads[1].mean == 1));
  tape.reset();
  CHECK(inspector.gradient_stats()[0].count == 4);  // kept after the pass
}

TEST_CASE("inspect: layers with a ReLU, whose gradients are masked unless statistics ask for them") {
  const Tensor<double> x({1, 2}, {1, 1}), w({2, 2}, {1, -1, 2, -2}), b({2});
  const auto run = [&](InspectOptions options) {
    Tape<double> tape;
    TapeInspector<double> inspector(tape, options);
    Tensor<double> dw({2, 2});
    const auto hidden =
        tape.name(dense(tape.constant(x), tape.leaf(w, dw), tape.constant(b), Activation::relu), "hidden");
    const auto out = dense(hidden, tape.constant(w), tape.constant(b));
    tape.backward(sum(out));
    tape.backward(out, std::vector<double>{1, 2});
    return std::pair(dw.data, inspector.gradient_stats());
  };
  const auto [plain, none] = run({.stop_at_nonfinite = true});
  const auto [inspected, stats] = run({.stop_at_nonfinite = true, .statistics = true});
  CHECK(plain == inspected);
  CHECK(none.empty());
  REQUIRE(stats.size() == 1);
  // hidden = relu(3, -3); dL/dhidden = w (1, 2) = (-1, -2) in front of the next layer, not (-1, 0).
  CHECK((stats[0].name == "hidden" && stats[0].mean == -1.5 && stats[0].zeros == 0));
}

TEST_CASE("inspect: without the option no statistics are gathered") {
  Tape<double> tape;
  TapeInspector<double> inspector(tape);
  Tensor<double> g({2, 2});
  tape.backward(sum(tape.name(tape.leaf(kSmall, g), "x")));
  CHECK((inspector.gradient_stats().empty() && inspector.value_stats().empty()));
}

TEST_CASE("inspect: errors and lifetime") {
  Tape<double> tape;
  {
    TapeInspector<double> first(tape);
    CHECK_THROWS_WITH(TapeInspector<double>(tape), "[inspect] the tape has an inspector already");
    CHECK(tape.observer() != nullptr);
  }
  CHECK(tape.observer() == nullptr);
}
