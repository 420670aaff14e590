#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/gradcheck_cases.h>
#include <fieldmark/engine/gradcheck_second_order.h>
#include <fieldmark/engine/ops/layout.h>

#include <cmath>
#include <limits>
#include <set>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;

namespace {

const auto kSecondOrderSine = [](auto&, auto x) { return sin(x[0]); };
const double kSecondOrderNan = std::numeric_limits<double>::quiet_NaN();

// sin with a custom tangent for Duals.
template <class F>
GradcheckReport check_sine(F tangent) {
  SmoothFn f(kSecondOrderSine);
  f.duals = [=](Tape<double>&, std::span<const Dual<double>> x) {
    const Var<double> v = x[0].value();
    return x[0].has_tangent() ? Dual<double>(sin(v), tangent(v, x[0].tangent())) : Dual<double>(sin(v));
  };
  return gradcheck_second_order(f, std::vector{uniform({4}, 0.2, 1, 3)});
}

}  // namespace

TEST_CASE("gradcheck_second_order: refuses options with which everything would pass, and no inputs") {
  const auto check = [](GradcheckOptions options) {
    return gradcheck_second_order(kSecondOrderSine, std::vector{uniform({4}, -1, 1, 3)}, options);
  };
  CHECK_THROWS_WITH(check({.rtol = 0}), "[gradcheck_second_order] rtol must be above 0 and below 1, got 0");
  CHECK_THROWS_AS(check({.rtol = kSecondOrderNan}), ValueError);
  CHECK_THROWS_WITH(check({.step = 0}), "[gradcheck_second_order] step must be positive and finite, got 0");
  CHECK_THROWS_WITH(gradcheck_second_order(kSecondOrderSine, {}),
                    "[gradcheck_second_order] inputs must be at least one tensor, got none");
}

TEST_CASE("gradcheck_second_order: passes a right tangent and counts its entries") {
  const auto r = gradcheck_second_order(kSecondOrderSine, std::vector{uniform({4}, -1, 1, 3)});
  INFO(r.table);
  CHECK(r.ok);
  CHECK(r.worst < 1e-9);
  CHECK(r.entries == 8);
  CHECK(check_sine([](auto x, auto t) { return mul(t, cos(x)); }).ok);
}

TEST_CASE("gradcheck_second_order: fails every wrong tangent and names the product") {
  const auto wrong = [](auto tangent, const char* name) {
    const auto r = check_sine(tangent);
    INFO(r.table);
    CHECK_FALSE(r.ok);
    CHECK_THAT(r.table, Contains(name));
  };
  wrong([](auto x, auto t) { return scale(mul(t, cos(x)), 1 + 1e-6); }, "J v [0]");
  wrong([](auto x, auto t) { return scale(mul(t, cos(x)), 1 + 1e-10); }, "<u, J v> and <J^T u, v>");
  wrong([](auto x, auto t) { return scale(mul(t, cos(x)), kSecondOrderNan); }, "product=nan");
  wrong([](auto x, auto t) { return mul(t, detach(cos(x))); }, "H v, input 0 [0]");  // no second derivative
}

TEST_CASE("gradcheck_second_order: fails a wrong gradient, another value and another shape") {
  const std::vector<Tensor<double>> in{uniform({4}, 0.2, 1, 3)};
  SmoothFn f(kSecondOrderSine);
  f.vars = [](Tape<double>&, std::span<const Var<double>> x) { return detach(sin(x[0])); };
  CHECK_THAT(gradcheck_second_order(f, in).table, Contains("<u, J v> and <J^T u, v>"));
  f.vars = [](Tape<double>&, std::span<const Var<double>> x) { return affine(sin(x[0]), 1, 1e-9); };
  CHECK_THAT(gradcheck_second_order(f, in).table, Contains("value 0 of Duals is another than of Vars"));
  f.vars = [](Tape<double>&, std::span<const Var<double>> x) { return reshape(sin(x[0]), {2, 2}); };
  CHECK_THROWS_WITH(gradcheck_second_order(f, in), Contains("must have the shape of f's value, [2, 2]"));
}

TEST_CASE("gradcheck_second_order: the engine's checks leave out what has no tangent, and nothing else") {
  std::set<std::string> names, without;
  for (const auto& c : gradcheck_cases()) names.insert(c.name);
  for (const auto& name : names)
    if (!name.ends_with(", second order") && !names.contains(name + ", second order")) without.insert(name);
  CHECK(without == std::set<std::string>{
                       "batch_norm: module", "conv2d layer", "conv2d layer without a bias, with stride",
                       "conv_transpose2d", "dense layer", "dense layer of parts", "dropout",
                       "eigenvalues: symmetric_eigenvalues", "embedding", "group_norm: module",
                       "layer_norm: module", "pool: max_pool", "tape: part of a value"});
}
