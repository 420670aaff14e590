#include <fieldmark/engine/dual.h>
#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/ops/eigenvalues.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/values.h>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;

namespace {

template <class V>
concept HasTanh = requires(V x) {
  tanh(x);
};
template <class V>
concept HasMaxPool = requires(V x) {
  max_pool(x, MaxPool{});
};
template <class V>
concept HasEigenvalues = requires(V x) {
  symmetric_eigenvalues(x);
};
template <class V>
concept HasLayer = requires(const Dense<double>& layer, const Params<double>& p, V x) {
  layer(p, x);
};
template <class A, class B>
concept HasAdd = requires(A a, B b) {
  add(a, b);
};

}  // namespace

TEST_CASE("dual: an op without a tangent does not compile") {
  STATIC_REQUIRE((HasTanh<Var<double>> && HasTanh<Dual<double>>));
  STATIC_REQUIRE((HasMaxPool<Var<double>> && !HasMaxPool<Dual<double>>));
  STATIC_REQUIRE((HasEigenvalues<Var<double>> && !HasEigenvalues<Dual<double>>));
  STATIC_REQUIRE((HasLayer<Var<double>> && !HasLayer<Dual<double>>));
}

TEST_CASE("dual: Vars and Duals of one scalar type mix, others do not") {
  STATIC_REQUIRE(HasAdd<Dual<double>, Var<double>>);
  STATIC_REQUIRE(HasAdd<Var<float>, Dual<float>>);
  STATIC_REQUIRE(!HasAdd<Dual<double>, Var<float>>);
  STATIC_REQUIRE(!HasAdd<Dual<double>, Dual<float>>);
}

TEST_CASE("dual: a value without tangent has zeros, and so has what comes of it") {
  const auto t = uniform({2, 3}, 0.5, 1, 1);
  Tape<double> tape;
  const Dual<double> x = tape.constant(t);
  CHECK(x.shape() == Shape{2, 3});
  CHECK(&x.tape() == &tape);
  CHECK_FALSE(x.has_tangent());
  CHECK(to_tensor(x.tangent()).data == std::vector<double>(6, 0.0));
  const Dual<double> y = mul(exp(x), x);
  CHECK_FALSE(y.has_tangent());
  CHECK(to_tensor(y.value()).data == to_tensor(mul(exp(x.value()), x.value())).data);
}

TEST_CASE("dual: tangents that are constants leave nothing to a backward") {
  const auto t = uniform({3}, 0.5, 1, 1);
  Tape<double> tape;
  const Dual<double> y = exp(Dual<double>(tape.constant(t), tape.constant(t)));
  CHECK(y.has_tangent());
  CHECK_FALSE(y.tangent().needs_grad());
}

TEST_CASE("dual: errors") {
  const Tensor<double> a({2}), b({3});
  Tape<double> tape, other;
  CHECK_THROWS_WITH(Dual<double>(tape.constant(a), tape.constant(b)),
                    "[dual] tangent must have the shape of its value, [2], got shape [3]");
  CHECK_THROWS_WITH(Dual<double>(tape.constant(a), other.constant(a)),
                    "[dual] value and tangent must be recorded on one tape, got two");
}
