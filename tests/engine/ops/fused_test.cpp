#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/fused.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/values.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {

// Chains that work for both Lane and Var.
template <class F>
void for_each_chain(F f) {
  f("arithmetic", [](auto x, auto z) { return (x * z - x / z + 2.f * x) / 3.f - (1.f - z) * (4.f / z); });
  f("functions", [](auto x, auto z) { return tanh(x) * softplus(z) + exp(-square(x)) * sigmoid(z); });
  f("roots", [](auto x, auto z) { return sqrt(abs(x)) * log(square(z) + 0.1f) + reciprocal(z); });
  f("kinks", [](auto x, auto z) { return relu(x) + minimum(x, z) * maximum(x, z) - abs(z - x); });
}
const auto as_one = [](auto chain) { return [=](auto&, auto v) { return fused(chain, v[0], v[1]); }; };
// Returns the largest difference, relative to the largest magnitude.
double relative_error(const std::vector<double>& got, const std::vector<double>& want) {
  REQUIRE(got.size() == want.size());
  double off = 0, largest = 1e-30;
  for (std::size_t i = 0; i < got.size(); ++i) {
    raise_to(off, std::abs(got[i] - want[i]));
    raise_to(largest, std::abs(want[i]));
  }
  return off / largest;
}
const auto step_by_step = [](auto chain) { return [=](auto&, auto v) { return chain(v[0], v[1]); }; };

}  // namespace

TEST_CASE("fused: values and gradients as of the ops one by one, for shapes that repeat too") {
  for (const auto& [sa, sb] : {std::pair<Shape, Shape>{{1100}, {1100}},
                               {{7, 300}, {300}},
                               {{7, 300}, {7, 1}},
                               {{}, {7, 3, 70}},
                               {{5, 1, 40}, {3, 40}}}) {
    const std::vector<Tensor<double>> inputs{uniform(sa, 0.2, 2, 1), uniform(sb, 0.2, 2, 2)};
    for_each_chain([&](const char* name, auto chain) {
      CAPTURE(name, sa.str(), sb.str());
      const auto want = run_op(step_by_step(chain), inputs), got = run_op(as_one(chain), inputs);
      REQUIRE(got.size() == want.size());
      for (std::size_t k = 0; k < got.size(); ++k) CHECK(relative_error(got[k], want[k]) <= 1e-13);
    });
  }
}

TEST_CASE("fused: float is as close to double as the ops one by one, on every instruction set") {
  const std::vector<Tensor<float>> inputs{uniform<float>({3, 333}, 0.2, 2, 1),
                                          uniform<float>({333}, 0.2, 2, 2)};
  for_each_chain([&](const char* name, auto chain) {
    CAPTURE(name);
    CHECK(float_error(as_one(chain), inputs) <= 2e-6);
  });
}

TEST_CASE("fused: the same bits for any number of threads") {
  const std::vector<Tensor<float>> inputs{uniform<float>({3, 40000}, 0.2, 2, 1),
                                          uniform<float>({3, 1}, 0.2, 2, 2)};
  for_each_chain([&](const char* name, auto chain) {
    CAPTURE(name);
    expect_same_bits(as_one(chain), inputs);
  });
}

TEST_CASE("fused: log in float from the least numbers to infinity, and NaN goes through every function") {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const auto logs = [](std::vector<float> x) {
    const Tensor<float> t({static_cast<Index>(x.size())}, x);
    return op_values([](auto&, auto v) { return fused([](auto a) { return log(a); }, v[0]); },
                     std::vector{t});
  };
  const std::vector<float> x{1e-45f, 1e-40f, 1e-38f, 0.1f, 0.5f, 0.999999f, 1, 1.000001f, 2, 3e38f};
  const auto y = logs(x);
  for (std::size_t i = 0; i < x.size(); ++i) {
    CAPTURE(x[i]);
    const double want = std::log(static_cast<double>(x[i]));
    CHECK(std::abs(y[i] - want) <= 3e-7 * std::abs(want));
  }
  const auto special = logs({0, -1, inf, nan});
  CHECK(special[0] == -inf);
  CHECK((std::isnan(special[1]) && special[2] == inf && std::isnan(special[3])));
  for_each_chain([&](const char* name, auto chain) {
    CAPTURE(name);
    const std::vector<Tensor<float>> inputs{{{1}, std::vector<float>{nan}}, {{1}, std::vector<float>{1}}};
    CHECK(std::isnan(op_values(as_one(chain), inputs)[0]));
  });
}

TEST_CASE("fused: nothing of no elements, and errors") {
  CHECK(run_op(as_one([](auto x, auto z) { return x * z; }),
               std::vector<Tensor<double>>{Tensor<double>({0, 3}), Tensor<double>({3})})[0]
            .empty());
  Tape<double> tape, other;
  const Tensor<double> a({2, 3}), b({2}), c({2, 3});
  const auto product = [](auto x, auto z) { return x * z; };
  CHECK_THROWS_WITH(
      fused(product, tape.constant(a), tape.constant(b)),
      "[fused] b must broadcast with a, whose shape is [2, 3] (extents equal or 1, counted from "
      "the last axis), got shape [2]");
  CHECK_THROWS_WITH(fused(product, tape.constant(a), other.constant(c)), Contains("another tape"));
}
