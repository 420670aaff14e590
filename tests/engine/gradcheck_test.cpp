#include <fieldmark/engine/gradcheck.h>

#include <cmath>
#include <limits>

#include "support/expect_grad.h"

using namespace fieldmark;

namespace {
enum class Wrong { none, factor, tiny, sign_of_one, assigns, nan, value };

// y = exp(x) * scale, with a backward that is wrong in a chosen way: the checker itself is under test.
Var<double> exp_with(Var<double> x, Wrong wrong, double scale = 1) {
  const Index n = x.shape().size();
  double* y = nullptr;
  Var<double> out = x.tape().output(x.shape(), &y, {x});
  for (Index i = 0; i < n; ++i) y[i] = scale * std::exp(x.value()[i]);
  if (wrong == Wrong::value && x.needs_grad()) y[0] += 1e-3;
  x.tape().on_backward(out, [=](const double* dy) {
    double* dx = x.grad_acc();
    for (Index i = 0; i < n; ++i) {
      double d = dy[i] * y[i];
      if (wrong == Wrong::factor) d *= 1 + 1e-6;
      if (wrong == Wrong::tiny) d = 0;
      if (wrong == Wrong::sign_of_one && i == 2) d = -d;
      if (wrong == Wrong::nan && i == 1) d = std::numeric_limits<double>::quiet_NaN();
      if (wrong == Wrong::assigns)
        dx[i] = d;
      else
        dx[i] += d;
    }
  });
  return out;
}

bool passes(Wrong wrong, double scale = 1) {
  const std::vector<Tensor<double>> in{uniform({4}, -1, 1, 3)};
  const auto r = gradcheck([&](Tape<double>&, auto v) { return exp_with(v[0], wrong, scale); }, in);
  CHECK(r.ok == r.table.empty());
  return r.ok;
}
}  // namespace

TEST_CASE("gradcheck: passes a right backward and fails every wrong one") {
  CHECK(passes(Wrong::none));
  for (Wrong w : {Wrong::factor, Wrong::tiny, Wrong::sign_of_one, Wrong::assigns, Wrong::nan, Wrong::value})
    CHECK_FALSE(passes(w));
}

TEST_CASE("gradcheck: small gradients are judged against their own size") {
  CHECK(passes(Wrong::none, 1e-6));
  CHECK_FALSE(passes(Wrong::sign_of_one, 1e-6));
}

TEST_CASE("gradcheck: inputs of size 0 and 1") {
  for (Index n : {0, 1})
    expect_grad([](Tape<double>&, auto v) { return exp_with(v[0], Wrong::none); }, {uniform({n}, -1, 1, 5)});
}

TEST_CASE("gradcheck: a module's parameters are an input too") {
  ParamStore<double> store;
  const auto id = store.add("w", {3});
  for (double& v : store.values()) v = 0.3;
  for (Wrong w : {Wrong::none, Wrong::factor}) {
    const auto r = gradcheck_module(
        [&](Tape<double>& tape, const Params<double>& p, auto) { return exp_with(p.leaf(tape, id), w); },
        store, {});
    CHECK(r.ok == (w == Wrong::none));
    CHECK(r.entries == 3);
  }
}
