#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/tape.h>
#include <fieldmark/engine/values.h>

#include <type_traits>

#include "support/catch.h"

using namespace fieldmark;

static_assert(std::is_trivially_copyable_v<Var<float>>, "a backward holds it by value");
static_assert(sizeof(Var<float>) == sizeof(void*));

TEST_CASE("var: tells its shape, values, tape and whether gradients reach it") {
  Tape<double> tape;
  const Tensor<double> x({1, 2}, std::vector<double>{3, 4});
  Tensor<double> g({1, 2});
  const Var<double> leaf = tape.leaf(x, g), fixed = tape.constant(x), sum = add(leaf, fixed);
  CHECK(leaf.shape() == Shape{1, 2});
  CHECK(leaf.value() == x.data.data());
  CHECK(&sum.tape() == &tape);
  CHECK(sum.needs_grad());
  CHECK_FALSE(fixed.needs_grad());
  CHECK(fixed.grad_acc() == nullptr);
  CHECK(leaf.id() != fixed.id());
  CHECK(Var<double>(leaf).id() == leaf.id());
}

TEST_CASE("var: grad_acc zeroes a new buffer, or leaves it to the caller to assign") {
  Tape<double> tape;
  const Tensor<double> x({2}, 3.0);
  Tensor<double> g({2});
  const Var<double> leaf = tape.leaf(x, g), a = add(leaf, leaf), b = add(leaf, leaf);
  CHECK(a.grad() == nullptr);
  CHECK(a.grad_acc()[1] == 0);
  bool fresh = false;
  double* to = b.grad_acc(&fresh);
  CHECK(fresh);
  to[0] = 1, to[1] = 2;
  CHECK(b.grad_acc(&fresh) == to);
  CHECK_FALSE(fresh);
  CHECK(b.grad()[1] == 2);
}

TEST_CASE(
    "var: the gradient of a ReLU layer's output is an error unless it was asked for, then it is whole") {
  const Tensor<double> x({1, 2}, std::vector<double>{1, 2}), b({2}),
      w({2, 2}, std::vector<double>{1, -1, 1, -1}), v({2, 1}, std::vector<double>{3, 5}), c({1});
  for (const bool kept : {false, true}) {
    CAPTURE(kept);
    Tape<double> tape;
    Tensor<double> dx({1, 2});
    const auto hidden = dense(tape.leaf(x, dx), tape.constant(w), tape.constant(b), Activation::relu);
    const auto y = dense(hidden, tape.constant(v), tape.constant(c));
    CHECK(hidden.grad() == nullptr);
    if (kept) tape.keep_grad(hidden);
    tape.backward(y);
    CHECK(dx.data == std::vector<double>{3, 3});
    if (kept)
      CHECK(grad_to_tensor(hidden).data == std::vector<double>{3, 5});
    else
      CHECK_THROWS_WITH(hidden.grad(), Contains("keep_grad()"));
    if (!kept) CHECK_THROWS_WITH(tape.keep_grad(hidden), Contains("must be called before the backward"));
  }
}
