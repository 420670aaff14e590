#include <fieldmark/nerf/distortion_loss.h>

#include <algorithm>
#include <cmath>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
// Samples packed by rays, with positions sorted along each ray.
template <class T = double>
struct Packed {
  std::vector<Index> begin;
  Tensor<T> sigma, delta, middle;
  explicit Packed(std::vector<Index> offsets, double offset = 0) : begin(std::move(offsets)) {
    const Index n = begin.back();
    sigma = uniform<T>({n}, 0, 8, 1);
    delta = uniform<T>({n}, 0.01, 0.3, 2);
    middle = uniform<T>({n}, offset, offset + 2, 3);
    for (std::size_t r = 0; r + 1 < begin.size(); ++r)
      std::sort(middle.data.begin() + begin[r], middle.data.begin() + begin[r + 1]);
  }
  auto op(double scale = 1) const {
    return [this, scale](auto&, auto v) {
      return distortion_loss<T>(v[0], delta.data, middle.data, begin, scale);
    };
  }
};

// Computes the formula's double sum in long double.
template <class T>
double reference(const Packed<T>& p, double scale) {
  long double total = 0;
  for (std::size_t r = 0; r + 1 < p.begin.size(); ++r) {
    std::vector<long double> w;
    long double depth = 0;
    for (Index i = p.begin[r]; i < p.begin[r + 1]; ++i) {
      const long double x = static_cast<long double>(p.sigma[i]) * static_cast<long double>(p.delta[i]);
      w.push_back(std::exp(-depth) * -std::expm1(-x));
      depth += x;
    }
    for (std::size_t i = 0; i < w.size(); ++i) {
      const Index at = p.begin[r] + static_cast<Index>(i);
      total += w[i] * w[i] * static_cast<long double>(p.delta[at]) / 3;
      for (std::size_t j = 0; j < w.size(); ++j)
        total += w[i] * w[j] *
                 std::abs(static_cast<long double>(p.middle[at]) -
                          static_cast<long double>(p.middle[p.begin[r] + static_cast<Index>(j)]));
    }
  }
  const auto rays = static_cast<long double>(p.begin.size() - 1);
  return static_cast<double>(scale * total / rays);
}
}  // namespace

TEST_CASE("distortion_loss: equal to the double sum over all pairs") {
  const Packed<> p({0, 5, 5, 6, 40, 41});
  const double want = reference(p, 1.5);
  CHECK(std::abs(op_values<double>(p.op(1.5), {p.sigma})[0] - want) < 1e-14 * want);
}

TEST_CASE("distortion_loss: in float and far from the origin, to 3e-6 of the double sum") {
  for (const double offset : {0.0, 100.0}) {
    const Packed<float> p({0, 300, 1000}, offset);
    const double want = reference(p, 1);
    CAPTURE(offset, want);
    // Measured: 4e-8 and 9e-8; with products of positions and sums, the error at 100 would be 1e-3.
    CHECK(std::abs(static_cast<double>(op_values<float>(p.op(), {p.sigma})[0]) - want) < 3e-6 * want);
  }
}

TEST_CASE("distortion_loss: nothing where there is nothing, and a third of the width for one solid sample") {
  CHECK(op_values<double>(Packed<>({0, 0, 0}).op(), {Tensor<double>(Shape{0})})[0] == 0);
  CHECK(op_values<double>(Packed<>({0, 9}).op(), {Tensor<double>(Shape{9})})[0] == 0);
  const std::vector<double> delta{0.3}, middle{7};
  const std::vector<Index> begin{0, 1};
  const auto op = [&](auto&, auto v) { return distortion_loss<double>(v[0], delta, middle, begin); };
  CHECK(std::abs(op_values<double>(op, {Tensor<double>(Shape{1}, 1e9)})[0] - 0.1) < 1e-16);
}

TEST_CASE("distortion_loss: gradient, also of saturated and empty rays") {
  for (const auto& begin : {std::vector<Index>{0}, {0, 0}, {0, 1}, {0, 4, 4, 11}}) {
    const Packed<> p(begin, 3);
    expect_grad(p.op(2), {p.sigma});
  }
  Packed<> p({0, 6});
  for (Index i = 0; i < 6; ++i) p.sigma[i] = i < 3 ? 1e4 : 2.0;  // opaque from the first sample on
  Tape<double> tape;
  std::vector<double> grad(6);
  const Var<double> sigma = tape.leaf(p.sigma.data.data(), grad.data(), {6});
  tape.backward(distortion_loss<double>(sigma, p.delta.data, p.middle.data, p.begin));
  for (const double g : grad) CHECK(std::isfinite(g));
}

TEST_CASE("distortion_loss: errors name argument and what came") {
  Tape<double> t;
  const Tensor<double> sigma(Shape{2});
  const std::vector<double> two(2), three(3);
  const std::vector<Index> good{0, 2}, bad{0, 1};
  const auto run = [&](const std::vector<double>& middle, const std::vector<Index>& begin, double scale) {
    distortion_loss<double>(t.constant(sigma), two, middle, begin, scale);
  };
  CHECK_THROWS_WITH(run(three, good, 1), Contains("each of 2 samples, got 2 and 3"));
  CHECK_THROWS_WITH(run(two, bad, 1), Contains("end at the sample count 2"));
  CHECK_THROWS_WITH(run(two, good, -1), Contains("scale must be at least 0, got -1"));
}

TEST_CASE("distortion_loss: the same bits for one and two threads") {
  std::vector<Index> begin{0, 200, 201};
  while (begin.back() < 100000) begin.push_back(begin.back() + 37);
  const Packed<float> p(begin);
  expect_same_bits(p.op(), {p.sigma});
}

TEST_CASE("distortion_loss: takes vectors, with the type of the Var") {
  const std::vector<float> delta{0.5f}, middle{7};
  const std::vector<Index> begin{0, 1};
  const auto op = [&](auto&, auto v) { return distortion_loss(v[0], delta, middle, begin); };
  CHECK(op_values<float>(op, {Tensor<float>(Shape{1}, 1e9f)})[0] == Approx(0.5 / 3).epsilon(1e-6));
}
