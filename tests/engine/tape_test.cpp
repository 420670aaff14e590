#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/tape.h>
#include <fieldmark/engine/values.h>

#include <utility>

#include "support/catch.h"

using namespace fieldmark;

namespace {
// y = x^2, the smallest possible op.
Var<double> square(Var<double> x) {
  const Index n = x.shape().size();
  double* y = nullptr;
  Var<double> out = x.tape().output(x.shape(), &y, {x});
  for (Index i = 0; i < n; ++i) y[i] = x.value()[i] * x.value()[i];
  x.tape().on_backward(out, [x, n](const double* dy) {
    double* dx = x.grad_acc();
    for (Index i = 0; i < n; ++i) dx[i] += 2 * x.value()[i] * dy[i];
  });
  return out;
}
}  // namespace

TEST_CASE("tape: gradients go through a chain, a fan-out and onto what the leaf held") {
  Tape<double> tape;
  const Tensor<double> x({1}, 3.0);
  Tensor<double> g({1}, 100.0);
  const auto v = tape.leaf(x, g);
  const auto y = square(square(v));
  tape.backward(y);
  CHECK(y.value()[0] == 81);
  CHECK(g[0] == 100 + 4 * 27);
}

TEST_CASE("tape: a second backward begins anew for intermediates and adds to leaves") {
  Tape<double> tape;
  const Tensor<double> x({1}, 3.0);
  Tensor<double> g({1});
  const auto v = tape.leaf(x, g), shared = square(v);
  const auto first = square(shared), second = square(shared);
  tape.backward(first);
  CHECK(g[0] == 4 * 27);
  CHECK(shared.grad()[0] == 2 * 9);
  tape.backward(first);
  CHECK(g[0] == 2 * 4 * 27);
  tape.backward(second);
  CHECK(g[0] == 3 * 4 * 27);
  CHECK(shared.grad()[0] == 2 * 9);
  CHECK(first.grad() == nullptr);
  tape.backward(square(second));  // recorded after a backward: x^8
  CHECK(g[0] == 3 * 4 * 27 + 8 * 2187);
  tape.replay();  // no seed: no gradient
  CHECK(g[0] == 3 * 4 * 27 + 8 * 2187);
}

TEST_CASE("tape: seeds written by hand count for one replay, and a fresh leaf holds the last backward's") {
  Tape<double> tape;
  const Tensor<double> x({1}, 3.0);
  Tensor<double> g({1}, 100.0);
  const auto v = tape.fresh_leaf(x.data.data(), g.data.data(), {1});
  const auto y = square(v);
  for (double seed : {1., 10.}) {
    y.grad_acc()[0] += seed;
    tape.replay();
    CHECK(g[0] == 6 * seed);
  }
}

TEST_CASE("tape: a backward that threw leaves nothing for the next") {
  Tape<double> tape;
  const Tensor<double> x({1}, 3.0);
  Tensor<double> g({1});
  static bool fails;
  fails = true;
  const auto inner = square(tape.leaf(x, g));
  double* y = nullptr;
  const auto out = tape.output({1}, &y, {inner});
  *y = inner.value()[0];
  tape.on_backward(out, [inner](const double* dy) {
    inner.grad_acc()[0] += *dy;
    if (fails) throw ValueError("half done");
  });
  CHECK_THROWS_WITH(tape.backward(out), "half done");
  fails = false;
  tape.backward(out);
  CHECK(g[0] == 6);
}

namespace {
template <class V>
concept IsConstant = requires(Tape<double>& tape, V&& v) {
  tape.constant(std::forward<V>(v));
};
template <class V>
concept IsLeaf = requires(Tape<double>& tape, V&& v, Tensor<double>& g) {
  tape.leaf(std::forward<V>(v), g);
};
}  // namespace

TEST_CASE("tape: a temporary, which would die before the pass, does not compile") {
  STATIC_REQUIRE((IsConstant<Tensor<double>&> && IsConstant<const Tensor<double>&>));
  STATIC_REQUIRE((IsLeaf<Tensor<double>&> && IsLeaf<const Tensor<double>&>));
  STATIC_REQUIRE_FALSE((IsConstant<Tensor<double>> || IsConstant<const Tensor<double>>));
  STATIC_REQUIRE_FALSE((IsLeaf<Tensor<double>> || IsLeaf<const Tensor<double>>));
}

TEST_CASE("tape: values of two tapes do not mix") {
  Tape<double> tape, other;
  const Tensor<double> x({1}, 3.0);
  Tensor<double> g({1});
  const auto mine = tape.leaf(x, g), theirs = other.leaf(x, g);
  double* y = nullptr;
  CHECK_THROWS_WITH(tape.output({1}, &y, {mine, theirs}),
                    "[tape] the input of an op was recorded on another tape: record all that belongs "
                    "together on one");
  CHECK_THROWS_AS(mul(mine, theirs), ValueError);
  CHECK_THROWS_AS(concatenate({mine, theirs}), ValueError);
  CHECK_THROWS_AS(mse_loss(mine, theirs), ValueError);
  CHECK_THROWS_AS(tape.reshape(theirs, {1, 1}), ValueError);
  CHECK_THROWS_AS(tape.on_backward(theirs, [](const double*) {}), ValueError);
  CHECK_THROWS_WITH(tape.backward(theirs), Contains("the value to differentiate was recorded on another"));
}

TEST_CASE("tape: part reads a range and passes its gradients on") {
  Tape<double> tape;
  const Tensor<double> x({2, 3}, std::vector<double>{1, 2, 3, 4, 5, 6});
  Tensor<double> g({2, 3}, 1.0);
  const auto v = tape.leaf(x, g);
  const auto y = square(tape.part(v, 2, {1, 3}));
  CHECK(std::vector<double>(y.value(), y.value() + 3) == std::vector<double>{9, 16, 25});
  tape.backward(y, std::vector<double>{1, 10, 100});
  CHECK(g.data == std::vector<double>{1, 1, 7, 81, 1001, 1});
  CHECK_THROWS_WITH(tape.part(v, 4, {3}), "[part] elements 4 to 7 must lie within x, got shape [2, 3]");
  CHECK_THROWS_AS(tape.part(v, -1, {3}), ShapeError);
}

TEST_CASE("tape: constants record nothing, unreached branches are skipped") {
  Tape<double> tape;
  const Tensor<double> x({2}, 3.0);
  Tensor<double> g({2});
  CHECK_FALSE(square(tape.constant(x)).needs_grad());
  const auto v = tape.leaf(x, g);
  const auto unused = square(v);
  const double seed[] = {1, 2};
  tape.backward(square(v), seed);
  CHECK(unused.grad() == nullptr);
  CHECK(g.data == std::vector<double>{6, 12});
}

TEST_CASE("tape: reshape keeps numbers and passes gradients") {
  Tape<double> tape;
  const Tensor<double> x({2, 3}, 2.0);
  Tensor<double> g({2, 3}, 1.0);
  const auto y = tape.reshape(tape.leaf(x, g), {6});
  CHECK(y.shape() == Shape{6});
  const std::vector<double> seed{1, 2, 3, 4, 5, 6};
  tape.backward(y, seed);
  CHECK(g.data == std::vector<double>{2, 3, 4, 5, 6, 7});
  CHECK_THROWS_WITH(tape.reshape(y, {5}), "[reshape] shape must have the 6 elements of x, got shape [5]");
}

TEST_CASE("tape: several outputs seeded by hand are replayed at once") {
  Tape<double> tape;
  const Tensor<double> x({1}, 3.0);
  Tensor<double> g({1});
  const auto v = tape.leaf(x, g);
  const auto a = square(v), b = square(v);
  a.grad_acc()[0] += 1;
  b.grad_acc()[0] += 10;
  tape.replay();
  CHECK(g[0] == 66);
}

TEST_CASE("tape: a seed read in place gives the gradients of a copied one, pass after pass") {
  const Tensor<double> x({3}, std::vector<double>{1, -2, 3});
  Tensor<double> g({3});
  Tape<double> tape;
  const auto y = square(tape.fresh_leaf(x.data.data(), g.data.data(), {3}));
  const std::vector<double> first{1, 2, 3}, second{10, 20, 30};
  tape.backward_in_place(y, first);
  CHECK(g.data == std::vector<double>{2, -8, 18});
  CHECK(y.grad() == first.data());
  tape.backward_in_place(y, second);
  CHECK(g.data == std::vector<double>{20, -80, 180});
  tape.backward(y, first);
  CHECK(g.data == std::vector<double>{2, -8, 18});
  CHECK(y.grad() != second.data());
  CHECK(first == std::vector<double>{1, 2, 3});
  CHECK(second == std::vector<double>{10, 20, 30});
}

TEST_CASE("tape: a gradient that is added to a seed read in place leaves the caller's memory alone") {
  const Tensor<double> x({2}, std::vector<double>{3, 5});
  Tensor<double> g({2});
  Tape<double> tape;
  const auto y = square(tape.leaf(x, g)), z = square(y);
  z.grad_acc()[0] += 1;  // reaches y as 2 x^2 = 18
  const std::vector<double> seed{1, 2};
  tape.backward_in_place(y, seed);
  CHECK(seed == std::vector<double>{1, 2});
  CHECK(grad_to_tensor(y).data == std::vector<double>{19, 2});
  CHECK(g.data == std::vector<double>{6 * 19, 10 * 2});
}

TEST_CASE("tape: an empty seed read in place overwrites fresh gradients as a copied one does") {
  const Tensor<double> w({3}, 1.0);
  for (const bool in_place : {false, true}) {
    std::vector<double> g(3, 7.0);
    Tape<double> tape;
    const auto v = tape.fresh_leaf(w.data.data(), g.data(), {3});
    const auto none = slice(v, 0, 0, 0);
    const std::vector<double> seed;
    if (in_place)
      tape.backward_in_place(none, seed);
    else
      tape.backward(none, seed);
    CHECK(g == std::vector<double>(3, 0.0));
  }
}

TEST_CASE("tape: a seed read in place counts as a copied one for leaves, ReLU layers and errors") {
  const Tensor<double> x({1, 2}, std::vector<double>{-1, 2}), w({2, 2}, std::vector<double>{1, 0, 0, 1}),
      b({2});
  const std::vector<double> seed{5, 7};
  Tensor<double> g({1, 2}, 1.0);
  Tape<double> tape;
  tape.backward_in_place(tape.leaf(x, g), seed);
  CHECK(g.data == std::vector<double>{6, 8});
  g.data = {0, 0};
  tape.backward_in_place(dense(tape.leaf(x, g), tape.constant(w), tape.constant(b), Activation::relu), seed);
  CHECK(g.data == std::vector<double>{0, 7});
  CHECK_THROWS_WITH(tape.backward_in_place(square(tape.constant(x)), seed),
                    Contains("nothing to differentiate"));
  CHECK_THROWS_WITH(tape.backward_in_place(square(tape.leaf(x, g)), std::span(seed).first(1)),
                    Contains("got 1"));
}

TEST_CASE("tape: the gradient of a fresh leaf replaces what was there, and stays where none arrives") {
  Tape<double> tape;
  const Tensor<double> x({1}, 3.0);
  Tensor<double> g({1}, 100.0), untouched({1}, 7.0);
  const auto v = tape.fresh_leaf(x.data.data(), g.data.data(), {1});
  const auto unused = tape.fresh_leaf(x.data.data(), untouched.data.data(), {1});
  tape.backward(square(square(v)));
  CHECK(g[0] == 4 * 27);
  CHECK(unused.grad() == nullptr);
  CHECK(untouched[0] == 7);
}

TEST_CASE("tape: the seed of a ReLU layer's output counts only where the output is positive") {
  const Tensor<double> x({1, 3}, std::vector<double>{-1, 0, 2}),
      w({3, 3}, std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1}), b({3});
  for (const bool kept : {false, true}) {
    CAPTURE(kept);
    Tape<double> tape;
    Tensor<double> g({1, 3});
    const auto y = dense(tape.leaf(x, g), tape.constant(w), tape.constant(b), Activation::relu);
    if (kept) tape.keep_grad(y);
    tape.backward(y, std::vector<double>{5, 6, 7});
    CHECK(g.data == std::vector<double>{0, 0, 7});
    y.grad_acc()[0] += 1;
    y.grad_acc()[2] += 1;
    tape.replay();
    CHECK(g.data == std::vector<double>{0, 0, 8});
  }
}

TEST_CASE("tape: errors") {
  Tape<double> tape;
  const Tensor<double> x({2}, 3.0);
  Tensor<double> g({2});
  CHECK_THROWS_WITH(tape.backward(square(tape.leaf(x, g))),
                    "[backward] loss must have one element, got shape [2]");
  const double seed[] = {1, 1};
  CHECK_THROWS_WITH(tape.backward(square(tape.constant(x)), seed), Contains("nothing to differentiate"));
  CHECK_THROWS_WITH(tape.backward(square(tape.leaf(x, g)), std::span<const double>(seed, 1)),
                    Contains("got 1"));
}

TEST_CASE("tape: sizes that do not fit are errors") {
  Tape<double> tape;
  const Tensor<double> x({2}, 3.0), unfilled(Shape{2}, std::vector<double>{1});
  Tensor<double> shorter({1});
  CHECK_THROWS_WITH(tape.leaf(x, shorter), "[leaf] grad must have the 2 elements of t, got 1");
  CHECK_THROWS_WITH(tape.leaf(unfilled, shorter), "[leaf] t must have the elements of its shape [2], got 1");
  CHECK_THROWS_WITH(tape.constant(unfilled), Contains("[constant] t must have the elements"));
  CHECK_THROWS_WITH(tape.scratch(-3),
                    "[tape] a buffer must have 0 elements or more and fit into memory, got -3");
  CHECK_THROWS_AS(tape.scratch(Index{1} << 61), ValueError);
  double* y = nullptr;
  CHECK_THROWS_AS(tape.output({Index{1} << 61}, &y, {tape.constant(x)}), ValueError);
}

TEST_CASE("tape: a repeated step takes nothing from the system") {
  Tape<float> tape;
  const Tensor<float> x({1000}, 1.f);
  Tensor<float> g({1000});
  std::size_t calls = 0;
  for (int step = 0; step < 4; ++step) {
    tape.reset();
    auto v = tape.leaf(x, g);
    for (int i = 0; i < 10; ++i) v = tape.reshape(v, {1000});
    tape.backward(v, x.data);
    if (step == 1) calls = tape.arena().system_calls();
  }
  CHECK(tape.arena().system_calls() == calls);
}
