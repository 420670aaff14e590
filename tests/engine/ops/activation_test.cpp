#include <fieldmark/engine/ops/activation.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {
const auto f_relu = [](auto&, auto v) { return relu(v[0]); };
const auto f_sigmoid = [](auto&, auto v) { return sigmoid(v[0]); };
const auto f_tanh = [](auto&, auto v) { return tanh(v[0]); };
const auto f_exp = [](auto&, auto v) { return exp(v[0]); };
const auto f_truncated_exp = [](auto&, auto v) { return truncated_exp(v[0]); };
const auto f_softplus = [](auto&, auto v) { return softplus(v[0]); };

template <class F>
void for_all(F check) {
  check("relu", f_relu);
  check("sigmoid", f_sigmoid);
  check("tanh", f_tanh);
  check("exp", f_exp);
  check("truncated_exp", f_truncated_exp);
  check("softplus", f_softplus);
}

// Returns numbers between -3 and 3, none within 0.1 of relu's kink.
Tensor<double> away_from_zero(Shape s) {
  auto x = uniform(s, -2.9, 2.9, 4);
  for (double& v : x.data) v += v < 0 ? -0.1 : 0.1;
  return x;
}
}  // namespace

TEST_CASE("activation: values") {
  const std::vector<Tensor<double>> in{{{5}, {-2, 0, 0.5, 3, 20}}};
  const std::vector<double> e{std::exp(-2.), 1, std::exp(0.5), std::exp(3.), std::exp(20.)};
  CHECK(op_values(f_relu, in) == std::vector<double>{0, 0, 0.5, 3, 20});
  for (std::size_t i = 0; i < 5; ++i) {
    const double x = in[0].data[i];
    CHECK(std::abs(op_values(f_sigmoid, in)[i] - e[i] / (1 + e[i])) < 1e-15);
    CHECK(std::abs(op_values(f_tanh, in)[i] - (e[i] - 1 / e[i]) / (e[i] + 1 / e[i])) < 1e-15);
    CHECK(op_values(f_exp, in)[i] == std::exp(x));
    CHECK(op_values(f_truncated_exp, in)[i] == std::exp(std::min(x, 15.0)));
    CHECK(std::abs(op_values(f_softplus, in)[i] - std::log(1 + e[i])) < 1e-14);
  }
}

TEST_CASE("activation: gradient") {
  for_all([](const char* name, auto f) {
    for (Shape s : {Shape{0}, Shape{1}, Shape{4, 9}}) {
      CAPTURE(name, s.str());
      expect_grad(f, {away_from_zero(s)});
    }
  });
}

TEST_CASE("activation: gradients at special places") {
  const auto slope = [](auto f, double x) {
    Tape<double> tape;
    const Tensor<double> t({1}, x);
    Tensor<double> g({1});
    tape.backward(f(tape, std::vector<Var<double>>{tape.leaf(t, g)}));
    return g[0];
  };
  CHECK(slope(f_relu, 0) == 0);
  CHECK(slope(f_truncated_exp, 20) == std::exp(15.0));  // straight-through
  CHECK(slope(f_softplus, 1000) == 1);
  CHECK(slope(f_softplus, -1000) == 0);
  CHECK(slope(f_sigmoid, -1000) == 0);
  CHECK(slope(f_tanh, 1000) == 0);
}

TEST_CASE("activation: float against double on every instruction set") {
  for_all([](const char* name, auto f) {
    CAPTURE(name);
    CHECK(float_error(f, {uniform<float>({1003}, -5, 5, 6)}) < 5e-7);  // measured 2.4e-7
    // Within +-1: a single slope is judged by itself here, and y (1 - y), 1 - y^2 are exact to their largest.
    CHECK(float_error_to_130(f, [](Index e) { return std::vector{uniform<float>({e}, -1, 1, 6)}; }) < 1e-6);
  });
}

TEST_CASE("activation: same bits for any thread count") {
  for_all([](const char* name, auto f) {
    CAPTURE(name);
    expect_same_bits(f, {uniform<float>({100001}, -5, 5, 1)});
  });
}
