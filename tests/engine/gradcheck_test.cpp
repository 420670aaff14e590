#include <fieldmark/engine/gradcheck.h>

#include <cmath>
#include <limits>

#include "pass_visitor.h"
#include "support/expect_grad.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
enum class Wrong { none, factor, tiny, sign_of_one, assigns, nan, value, fresh, unfilled, spends };

// y = exp(x) * scale, with a backward that is wrong in a chosen way, to test the checker itself.
Var<double> exp_with(Var<double> x, Wrong wrong, double scale = 1) {
  const Index n = x.shape().size();
  double* y = nullptr;
  Var<double> out = x.tape().output(x.shape(), &y, {x});
  for (Index i = 0; i < n; ++i) y[i] = scale * std::exp(x.value()[i]);
  if (wrong == Wrong::value && x.needs_grad()) y[0] += 1e-3;
  x.tape().on_backward(out, [=](const double* dy) {
    bool fresh = false;
    double* dx = wrong == Wrong::fresh || wrong == Wrong::unfilled ? x.grad_acc(&fresh) : x.grad_acc();
    for (Index i = 0; i < n; ++i) {
      double d = dy[i] * y[i];
      if (wrong == Wrong::fresh && fresh) d = -d;
      if (wrong == Wrong::unfilled && fresh && i == 3) continue;
      if (wrong == Wrong::factor) d *= 1 + 1e-6;
      if (wrong == Wrong::tiny) d = 0;
      if (wrong == Wrong::sign_of_one && i == 2) d = -d;
      if (wrong == Wrong::nan && i == 1) d = std::numeric_limits<double>::quiet_NaN();
      if (wrong == Wrong::assigns || fresh)
        dx[i] = d;
      else
        dx[i] += d;
      if (wrong == Wrong::spends) y[i] = 0;  // overwrites what the backward still needs
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
  for (Wrong w : {Wrong::factor, Wrong::tiny, Wrong::sign_of_one, Wrong::assigns, Wrong::nan, Wrong::value,
                  Wrong::fresh, Wrong::unfilled, Wrong::spends}) {
    CAPTURE(static_cast<int>(w));
    CHECK_FALSE(passes(w));
  }
}

namespace {
enum class Subset { right, forgets_second, leaves_buffer };

// y = a b, with a mistake that shows only if one of the two needs no gradient.
Var<double> product(Var<double> a, Var<double> b, Subset wrong) {
  const Index n = a.shape().size();
  double* y = nullptr;
  Var<double> out = wrong == Subset::forgets_second ? a.tape().output(a.shape(), &y, {a})
                                                    : a.tape().output(a.shape(), &y, {a, b});
  for (Index i = 0; i < n; ++i) y[i] = a.value()[i] * b.value()[i];
  a.tape().on_backward(out, [=](const double* dy) {
    double *da = a.grad_acc(), *db = b.grad_acc();
    for (Index i = 0; da && i < n; ++i) da[i] += dy[i] * b.value()[i];
    if (wrong == Subset::leaves_buffer && !da) return;
    for (Index i = 0; db && i < n; ++i) db[i] += dy[i] * a.value()[i];
  });
  return out;
}
}  // namespace

TEST_CASE("gradcheck: takes every subset of the inputs that needs gradients, and names it") {
  const std::vector<Tensor<double>> in{uniform({3}, -1, 1, 3), uniform({3}, -1, 1, 4)};
  const auto check = [&](Subset wrong) {
    return gradcheck([=](Tape<double>&, auto v) { return product(v[0], v[1], wrong); }, in);
  };
  CHECK(check(Subset::right).ok);
  CHECK(check(Subset::right).entries == 6);
  for (Subset wrong : {Subset::forgets_second, Subset::leaves_buffer}) {
    const auto r = check(wrong);
    CHECK_FALSE(r.ok);
    CHECK_THAT(r.table, Contains("input 1 [0]") && Contains("(gradients for these inputs only: 1)"));
  }
}

TEST_CASE("gradcheck: of many inputs each alone and all but each") {
  const std::vector<Tensor<double>> in(8, uniform({1}, 0.5, 1, 3));
  const auto check = [&](Subset wrong) {
    return gradcheck(
        [=](Tape<double>&, auto v) {
          Var<double> y = v[0];
          for (std::size_t k = 1; k < v.size(); ++k) y = product(y, v[k], k == 7 ? wrong : Subset::right);
          return y;
        },
        in);
  };
  CHECK(check(Subset::right).ok);
  CHECK_THAT(check(Subset::forgets_second).table, Contains("only: 7)"));
}

TEST_CASE("gradcheck: small gradients are judged against their own size") {
  CHECK(passes(Wrong::none, 1e-6));
  CHECK_FALSE(passes(Wrong::sign_of_one, 1e-6));
}

TEST_CASE("gradcheck: inputs of size 0 and 1") {
  for (Index n : {0, 1})
    expect_grad([](Tape<double>&, auto v) { return exp_with(v[0], Wrong::none); }, {uniform({n}, -1, 1, 5)});
}

TEST_CASE("gradcheck: refuses options with which every gradient would pass") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const std::vector<Tensor<double>> in{uniform({4}, -1, 1, 3)};
  const auto check = [&](GradcheckOptions options) {
    return gradcheck([](Tape<double>&, auto v) { return exp_with(v[0], Wrong::sign_of_one); }, in, options);
  };
  CHECK_THROWS_WITH(check({.rtol = 0}), "[gradcheck] rtol must be above 0 and below 1, got 0");
  CHECK_THROWS_WITH(check({.rtol = -1e-9}), "[gradcheck] rtol must be above 0 and below 1, got -1e-09");
  CHECK_THROWS_WITH(check({.rtol = 1}), "[gradcheck] rtol must be above 0 and below 1, got 1");
  for (const double rtol : {nan, -nan, inf, -inf, -0.0}) CHECK_THROWS_AS(check({.rtol = rtol}), ValueError);
  CHECK_THROWS_WITH(check({.step = 0}), "[gradcheck] step must be positive and finite, got 0");
  CHECK_THROWS_WITH(check({.step = -1}), "[gradcheck] step must be positive and finite, got -1");
  CHECK_THROWS_WITH(check({.step = inf}), "[gradcheck] step must be positive and finite, got inf");
  CHECK_THROWS_AS(check({.step = nan}), ValueError);
  // The smallest and largest that are allowed still see the wrong sign.
  for (const double rtol : {1e-12, 0.999}) CHECK_FALSE(check({.rtol = rtol}).ok);
}

TEST_CASE("gradcheck: refuses to compare nothing") {
  const auto one = [](Tape<double>& tape, auto...) { return tape.constant(nullptr, {0}); };
  CHECK_THROWS_WITH(gradcheck(one, {}), "[gradcheck] inputs must be at least one tensor, got none");
  CHECK_THROWS_WITH(gradcheck_module(one, ParamStore<double>(), {}),
                    "[gradcheck_module] inputs must be at least one tensor, got none");
  ParamStore<double> store;
  store.add("w", {3});
  CHECK_THROWS_WITH(gradcheck_module(one, store, {}, {.rtol = 0}),
                    "[gradcheck_module] rtol must be above 0 and below 1, got 0");
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

TEST_CASE("gradcheck: adds to the gradients of a store that f reads, unless it reads it without gradients") {
  ParamStore<double> store;
  const auto id = store.add("w", {3});
  for (double& v : store.values()) v = 0.3;
  const std::vector<Tensor<double>> in{uniform({3}, -1, 1, 1)};
  const auto largest_after = [&](const Params<double>& params) {
    store.zero_grad();
    const auto f = [&](Tape<double>& tape, std::span<const Var<double>> x) {
      const Var<double> w = params.leaf(tape, id);
      double* y = nullptr;
      const Var<double> out = tape.output({3}, &y, {x[0], w});
      for (Index i = 0; i < 3; ++i) y[i] = x[0].value()[i] * w.value()[i];
      tape.on_backward(out, [x0 = x[0], w](const double* dy) {
        double *dx = x0.grad_acc(), *dw = w.grad_acc();
        for (Index i = 0; i < 3; ++i) {
          if (dx) dx[i] += dy[i] * w.value()[i];
          if (dw) dw[i] += dy[i] * x0.value()[i];
        }
      });
      return out;
    };
    CHECK(gradcheck(f, in).ok);
    double largest = 0;
    for (const double g : store.grads()) raise_to(largest, std::abs(g));
    return largest;
  };
  CHECK(largest_after(Params<double>(store)) > 0);
  CHECK(largest_after(Params<double>(store, nullptr)) == 0);
  const auto r = gradcheck_module([&](Tape<double>& tape, const Params<double>& p,
                                      auto) { return exp_with(p.leaf(tape, id), Wrong::none); },
                                  store, {});
  CHECK(r.ok);
  for (const double g : store.grads()) CHECK(g == 0);
}

TEST_CASE("gradcheck: a visitor receives the passes of its scope alone") {
  const std::vector<Tensor<double>> in{uniform({3}, -1, 1, 1)};
  const GradcheckFn wrong = [](Tape<double>&, auto x) { return exp_with(x[0], Wrong::factor); };
  int visits = 0;
  {
    const detail::ScopedPassVisitor::Visit visit = [&](const std::function<void()>& pass) {
      pass();
      ++visits;
    };
    const detail::ScopedPassVisitor scope(visit);
    CHECK(gradcheck(wrong, in).ok);  // compares nothing
  }
  CHECK(visits == 1);
  CHECK_FALSE(gradcheck(wrong, in).ok);
  CHECK(visits == 1);
}
