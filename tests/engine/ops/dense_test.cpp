#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>

#include "support/each_isa.h"
#include "support/expect_grad.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
struct DenseResult {
  std::vector<float> y, dx, dw, db;
  bool operator==(const DenseResult&) const = default;
};

DenseResult run_dense(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b,
                      Activation act) {
  Tape<float> tape;
  Tensor<float> dx(x.shape), dw(w.shape), db(b.shape);
  const auto y = dense(tape.leaf(x, dx), tape.leaf(w, dw), tape.leaf(b, db), act);
  const std::vector<float> values(y.value(), y.value() + y.shape().size());
  tape.backward(y, values);
  return {values, dx.data, dw.data, db.data};
}

// Computes the same in double, by loops.
DenseResult plain_dense(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b,
                        Activation act) {
  const Index n = x.shape[0], in = x.shape[1], out = w.shape[1];
  std::vector<double> y(n * out), dx(n * in), dw(in * out), db(out);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < out; ++j) {
      double s = b[j];
      for (Index k = 0; k < in; ++k) s += double(x[i * in + k]) * w[k * out + j];
      if (act == Activation::relu) s = std::max(s, 0.0);
      y[i * out + j] = s;  // also the cotangent: 0 where the ReLU is shut
      db[j] += s;
      for (Index k = 0; k < in; ++k) {
        dx[i * in + k] += s * w[k * out + j];
        dw[k * out + j] += s * x[i * in + k];
      }
    }
  const auto f = [](const std::vector<double>& v) { return std::vector<float>(v.begin(), v.end()); };
  return {f(y), f(dx), f(dw), f(db)};
}

double dense_error(const std::vector<float>& a, const std::vector<float>& b) {
  double worst = 0, size = 1e-30;
  for (std::size_t i = 0; i < a.size(); ++i) {
    raise_to(worst, std::abs(double(a[i]) - b[i]));
    raise_to(size, std::abs(double(b[i])));
  }
  return worst / size;
}
}  // namespace

TEST_CASE("dense: a batch of a few chunks has the bits of its chunks one after the other, on every isa") {
  each_isa([] {
    for (const Index out : {40, 64}) {  // padded rows, and whole vectors in place
      const Index n = 1100, in = 50;
      const auto x = uniform<float>({n, in}, -1, 1, 1), w = uniform<float>({in, out}, -1, 1, 2),
                 b = uniform<float>({out}, -1, 1, 3);
      const DenseResult whole = run_dense(x, w, b, Activation::relu);
      DenseResult parts{{}, {}, std::vector<float>(w.data.size()), std::vector<float>(b.data.size())};
      for (Index first = 0; first < n; first += 512) {
        const Index rows = std::min<Index>(512, n - first);
        Tape<float> tape;
        std::vector<float> dx(static_cast<std::size_t>(rows * in));
        const auto y = dense(tape.leaf(x.data.data() + first * in, dx.data(), {rows, in}),
                             tape.leaf(w.data.data(), parts.dw.data(), w.shape),
                             tape.leaf(b.data.data(), parts.db.data(), b.shape), Activation::relu);
        const std::vector<float> values(y.value(), y.value() + y.shape().size());
        tape.backward(y, values);
        parts.y.insert(parts.y.end(), values.begin(), values.end());
        parts.dx.insert(parts.dx.end(), dx.begin(), dx.end());
      }
      CAPTURE(out);
      CHECK(whole == parts);
    }
  });
}

TEST_CASE("dense: the float path, forward and all gradients, against double loops to 1e-6 of the largest") {
  each_isa([] {
    for (Index e = 1; e <= 130; ++e)
      for (Activation act : {Activation::none, Activation::relu}) {
        CAPTURE(e);
        const auto x = uniform<float>({e, 67}, -1, 1, 1), w = uniform<float>({67, 19}, -1, 1, 2),
                   b = uniform<float>({19}, -1, 1, 3);
        const auto x2 = uniform<float>({41, e}, -1, 1, 1), w2 = uniform<float>({e, 131 - e}, -1, 1, 2),
                   b2 = uniform<float>({131 - e}, -1, 1, 3);
        for (const auto& [got, want] :
             {std::pair{run_dense(x, w, b, act), plain_dense(x, w, b, act)},
              std::pair{run_dense(x2, w2, b2, act), plain_dense(x2, w2, b2, act)}}) {
          CHECK(dense_error(got.y, want.y) < 1e-6);
          CHECK(dense_error(got.dx, want.dx) < 1e-6);
          CHECK(dense_error(got.dw, want.dw) < 1e-6);
          CHECK(dense_error(got.db, want.db) < 1e-6);
        }
      }
  });
}

TEST_CASE("dense: gradient") {
  for (Activation act : {Activation::none, Activation::relu}) {
    const GradcheckFn f = [act](Tape<double>&, auto v) { return dense(v[0], v[1], v[2], act); };
    expect_grad(f, {uniform({4, 3}, 0.1, 1, 1), uniform({3, 5}, 0.1, 1, 2), uniform({5}, -0.1, 0.1, 3)});
    expect_grad(f, {uniform({1, 1}, 0.2, 1, 1), uniform({1, 1}, 0.2, 1, 2), uniform({1}, 0, 0.1, 3)});
    expect_grad(f, {uniform({0, 3}, -1, 1, 1), uniform({3, 5}, -1, 1, 2), uniform({5}, -1, 1, 3)});
  }
}

TEST_CASE("dense: gradient through layers that mask for each other, with another op between") {
  // Every other unit is shut, and all are far from the kink.
  const auto alternating = [](Shape shape, std::uint64_t seed) {
    Tensor<double> w = uniform(shape, 0.2, 1, seed);
    for (Index i = 1; i < shape.size(); i += 2) w[i] = -w[i];
    return w;
  };
  for (bool branch : {false, true})
    expect_grad(
        [branch](Tape<double>&, auto v) {
          const auto first = dense(v[0], v[1], v[2], Activation::relu);
          const auto last = dense(first, v[3], v[4], Activation::relu);
          return branch ? concatenate({last, mul(first, first)}) : last;
        },
        {uniform({5, 4}, 0.2, 1, 1), alternating({4, 8}, 2), alternating({8}, 3), alternating({8, 6}, 4),
         alternating({6}, 5)});
}

TEST_CASE(
    "dense: one value as input and weight gets both gradients, for few rows and many, on 1 and 2 threads") {
  for (const Index n : {Index{3}, Index{600}}) {
    const auto gradient = [n](int threads, bool as_matmul) {
      const ScopedThreads scope(threads);
      Tape<double> tape;
      Tensor<double> h = uniform<double>({n, n}, -1, 1, 7), dh(h.shape), zeros(Shape{n});
      const auto intermediate = scale(tape.leaf(h, dh), 2.0);
      const auto y = as_matmul ? matmul(intermediate, intermediate)
                               : dense(intermediate, intermediate, tape.constant(zeros), Activation::none);
      tape.backward(y, uniform<double>({n, n}, -1, 1, 8).data);
      return dh.data;
    };
    const auto expected = gradient(1, true), one = gradient(1, false), two = gradient(2, false);
    double worst = 0;
    for (std::size_t i = 0; i < one.size(); ++i) raise_to(worst, std::abs(one[i] - expected[i]));
    CAPTURE(n, worst);
    CHECK(worst < 1e-10 * static_cast<double>(n));
    CHECK((one == two));
  }
}

TEST_CASE("dense: errors") {
  Tape<float> tape;
  const Tensor<float> x({2, 3}), w({3, 4}), b({4}), short_b({3}), tall({2, 4});
  CHECK_THROWS_WITH(
      dense(tape.constant(x), tape.constant(tall), tape.constant(b)),
      "[dense] w: axis 0 must be 3 (the columns of x, whose shape is [2, 3]), got shape [2, 4]");
  CHECK_THROWS_WITH(dense(tape.constant(x), tape.constant(w), tape.constant(short_b)),
                    Contains("[dense] b: axis 0 must be 4"));
}

TEST_CASE("dense: same bits for 1 and 2 threads, also where the rows are split") {
  const auto x = uniform<float>({20000, 16}, -1, 1, 1), w = uniform<float>({16, 24}, -1, 1, 2),
             b = uniform<float>({24}, -1, 1, 3);
  const ScopedThreads serial(1);
  const DenseResult one = run_dense(x, w, b, Activation::relu);
  const ScopedThreads parallel(2);
  CHECK(one == run_dense(x, w, b, Activation::relu));
}
