#include <fieldmark/engine/ops/batch_norm.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {

const auto f_batch = [](auto&, auto v) { return batch_norm(v[0], v[1], v[2]); };
const std::vector<double> kMean{0.2, -0.4, 1}, kVariance{0.5, 2, 0};
const auto f_fixed = [](Tape<double>&, std::span<const Var<double>> v) {
  return batch_norm_fixed<double>(v[0], v[1], v[2], kMean, kVariance, {.eps = 0.1});
};

template <class T = double>
std::vector<Tensor<T>> inputs(Shape s) {
  return {uniform<T>(s, -1, 2, 1), uniform<T>({s[3]}, 0.5, 1.5, 2), uniform<T>({s[3]}, -0.5, 0.5, 3)};
}

}  // namespace

TEST_CASE("batch_norm: values and statistics") {
  const auto in = inputs({3, 4, 5, 3});
  const auto y = op_values(f_batch, in);
  Tape<double> tape;
  BatchStatistics seen;
  batch_norm(tape.constant(in[0]), tape.constant(in[1]), tape.constant(in[2]), {}, &seen);
  for (std::size_t c = 0; c < 3; ++c) {
    double mean = 0, var = 0;
    for (std::size_t p = 0; p < 60; ++p) mean += in[0].data[p * 3 + c] / 60;
    for (std::size_t p = 0; p < 60; ++p) var += std::pow(in[0].data[p * 3 + c] - mean, 2) / 60;
    CHECK(std::abs(seen.mean[c] - mean) < 1e-15);
    CHECK(std::abs(seen.variance[c] - var) < 1e-15);
    for (std::size_t p = 0; p < 60; ++p) {
      const double xh = (in[0].data[p * 3 + c] - mean) / std::sqrt(var + 1e-5);
      CHECK(std::abs(y[p * 3 + c] - (xh * in[1].data[c] + in[2].data[c])) < 1e-14);
    }
  }
}

TEST_CASE("batch_norm: values with fixed statistics") {
  const auto in = inputs({2, 2, 1, 3});
  const auto y = op_values(f_fixed, in);
  for (std::size_t i = 0; i < y.size(); ++i) {
    const std::size_t c = i % 3;
    const double xh = (in[0].data[i] - kMean[c]) / std::sqrt(kVariance[c] + 0.1);
    CHECK(std::abs(y[i] - (xh * in[1].data[c] + in[2].data[c])) < 1e-15);
  }
}

TEST_CASE("batch_norm: gradient") {
  for (Shape s : {Shape{0, 2, 2, 3}, Shape{1, 1, 1, 3}, Shape{2, 3, 2, 3}, Shape{1, 5, 5, 3}}) {
    CAPTURE(s.str());
    expect_grad(f_batch, inputs(s));
    expect_grad(f_fixed, inputs(s));
  }
  expect_grad(f_batch, inputs({2, 3, 3, 0}));
  auto in = inputs({1, 2, 2, 1});
  in[0].data = {-1, 1, 0.5, -0.7};
  in[2].data = {0.1};
  for (double v : op_values(f_batch, in)) REQUIRE(std::abs(v) > 0.05);  // away from the ReLU's kink
  expect_grad([](auto&, auto v) { return batch_norm(v[0], v[1], v[2], {.relu = true}); }, in);
}

TEST_CASE("batch_norm: a constant channel and a batch of one pixel give beta") {
  for (Shape s : {Shape{2, 8, 8, 3}, Shape{1, 1, 1, 3}}) {
    auto in = inputs<float>(s);
    std::fill(in[0].data.begin(), in[0].data.end(), 0.7f);
    const auto r = run_op(f_batch, in);
    for (std::size_t i = 0; i < r[0].size(); ++i) CHECK(r[0][i] == in[2].data[i % 3]);
    for (float g : r[1]) CHECK(std::isfinite(g));
  }
}

TEST_CASE("batch_norm: errors") {
  Tape<double> tape;
  const Tensor<double> x({1, 2, 2, 3}), c({3}), wrong({5});
  const auto v = [&](const Tensor<double>& t) { return tape.constant(t); };
  const std::vector<double> few(2, 1.0), negative{1, -1, 1};
  CHECK_THROWS_WITH(batch_norm(v(c), v(c), v(c)), Contains("[batch_norm] x must have rank 4"));
  CHECK_THROWS_WITH(batch_norm(v(x), v(wrong), v(c)), Contains("gamma: axis 0 must be 3"));
  CHECK_THROWS_WITH(batch_norm(v(x), v(c), v(c), {.eps = -1}), Contains("eps must be above 0"));
  CHECK_THROWS_WITH(batch_norm_fixed<double>(v(x), v(c), v(c), few, kVariance),
                    "[batch_norm_fixed] mean must have one element for each of the 3 channels of x, got 2");
  CHECK_THROWS_WITH(batch_norm_fixed<double>(v(x), v(c), v(c), kMean, few), Contains("] variance must have"));
  CHECK_THROWS_WITH(batch_norm_fixed<double>(v(x), v(c), v(c), kMean, negative),
                    Contains("variance: channel 1 must be 0 or more, got -1"));
}

TEST_CASE("batch_norm: float against double, and the same bits for any thread count") {
  expect_same_bits(f_batch, inputs<float>({3, 40, 40, 24}));
  CHECK(float_error(f_batch, inputs<float>({3, 20, 21, 24})) < 4e-7);  // measured 1.4e-7
  CHECK(float_error_to_130(f_batch, [](Index e) {
          return inputs<float>({2, 3, 3, e});
        }) < 3e-6);  // measured 1.5e-6: dx of 18 numbers cancels
}
