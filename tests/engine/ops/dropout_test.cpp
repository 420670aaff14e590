#include <fieldmark/engine/ops/dropout.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {
const CounterRng kMasks(3, 7);
const auto f_dropout = [](auto&, auto v) { return dropout(v[0], 0.3, kMasks, 5); };
}  // namespace

TEST_CASE("dropout: an element stays where its random word says so, and is scaled") {
  const auto x = uniform({5, 7}, 0.5, 1, 1);
  const auto y = op_values(f_dropout, std::vector{x});
  REQUIRE(y.size() == 35);
  for (std::size_t i = 0; i < 35; ++i) {
    const double u = kMasks.bits(5, i / 4)[i % 4] / 4294967296.0;
    CHECK(y[i] == (u < 0.3 ? 0 : x.data[i] * (1 / 0.7)));
  }
}

TEST_CASE("dropout: as many are dropped as asked for, the mean stays, and another step drops others") {
  const Index n = 100000;
  const std::vector<Tensor<double>> ones{Tensor<double>({n}, 1)};
  for (const double p : {0.1, 0.5, 0.9}) {
    const auto y = op_values([p](auto&, auto v) { return dropout(v[0], p, kMasks, 1); }, ones),
               other = op_values([p](auto&, auto v) { return dropout(v[0], p, kMasks, 2); }, ones);
    double zeros = 0, sum = 0;
    for (const double v : y) {
      zeros += v == 0;
      sum += v;
    }
    const double count = static_cast<double>(n), spread = std::sqrt(p * (1 - p) / count);
    CHECK(std::abs(zeros / count - p) < 4 * spread);
    CHECK(std::abs(sum / count - 1) < 4 * spread / (1 - p));
    CHECK(y != other);
  }
}

TEST_CASE("dropout: nothing is dropped at p = 0, a NaN never") {
  Tape<double> tape;
  const Tensor<double> t({4}, NAN);
  const auto x = tape.constant(t), y = dropout(x, 0.9, kMasks, 1);
  CHECK(dropout(x, 0, kMasks, 1).id() == x.id());
  for (Index i = 0; i < 4; ++i) CHECK(std::isnan(y.value()[i]));
}

TEST_CASE("dropout: gradient") {
  for (Shape s : {Shape{0}, Shape{1}, Shape{5, 7}}) expect_grad(f_dropout, {uniform(s, -1, 1, 1)});
}

TEST_CASE("dropout: errors") {
  Tape<double> tape;
  const Tensor<double> t({4});
  const auto x = tape.constant(t);
  CHECK_THROWS_WITH(dropout(x, 1, kMasks, 0), Contains("[dropout] p must be in [0, 1), got 1"));
  CHECK_THROWS_AS(dropout(x, -0.1, kMasks, 0), ValueError);
  CHECK_THROWS_AS(dropout(x, std::nan(""), kMasks, 0), ValueError);
}

TEST_CASE("dropout: same bits for any thread count, the same mask in float and double") {
  const auto x = uniform<float>({100003}, -1, 1, 1);
  expect_same_bits(f_dropout, {x});
  CHECK(float_error(f_dropout, {x}) < 2e-7);
}
