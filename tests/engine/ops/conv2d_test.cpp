#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>

#include "support/each_isa.h"
#include "support/expect_grad.h"

using namespace fieldmark;

namespace {
struct Result {
  std::vector<float> y, dx, dw, db;
  bool operator==(const Result&) const = default;
};

Result run(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b, Activation act) {
  Tape<float> tape;
  Tensor<float> dx(x.shape), dw(w.shape), db(b.shape);
  const auto y = conv2d(tape.leaf(x, dx), tape.leaf(w, dw), tape.leaf(b, db), act);
  const std::vector<float> values(y.value(), y.value() + y.shape().size());
  tape.backward(y, values);
  return {values, dx.data, dw.data, db.data};
}

// The definition, in double.
Result plain(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b, Activation act) {
  const Index N = x.shape[0], H = x.shape[1], W = x.shape[2], C = x.shape[3], K = w.shape[0], O = w.shape[3],
              r = K / 2;
  std::vector<double> y(N * H * W * O), dx(x.size()), dw(w.size()), db(O);
  for (Index p = 0; p < N * H * W; ++p)
    for (Index o = 0; o < O; ++o) {
      const Index n = p / (H * W), i = p / W % H, j = p % W;
      const auto each = [&](auto&& f) {
        for (Index u = 0; u < K; ++u)
          for (Index v = 0; v < K; ++v)
            for (Index c = 0; c < C; ++c) {
              const Index a = i + u - r, e = j + v - r;
              if (a >= 0 && a < H && e >= 0 && e < W)
                f(((n * H + a) * W + e) * C + c, ((u * K + v) * C + c) * O + o);
            }
      };
      double s = b[o];
      each([&](Index xi, Index wi) { s += double(x[xi]) * w[wi]; });
      if (act == Activation::relu) s = std::max(s, 0.0);
      y[p * O + o] = s;
      db[o] += s;
      each([&](Index xi, Index wi) {
        dx[xi] += s * w[wi];
        dw[wi] += s * x[xi];
      });
    }
  const auto f = [](const std::vector<double>& v) { return std::vector<float>(v.begin(), v.end()); };
  return {f(y), f(dx), f(dw), f(db)};
}

double error(const std::vector<float>& a, const std::vector<float>& b) {
  double worst = 0, size = 1e-30;
  for (std::size_t i = 0; i < a.size(); ++i) {
    worst = std::max(worst, std::abs(double(a[i]) - b[i]));
    size = std::max(size, std::abs(double(b[i])));
  }
  return worst / size;
}
}  // namespace

TEST_CASE("conv2d: the float path, forward and all gradients, against the definition") {
  each_isa([] {
    for (const auto& [N, H, W, C, O, K] : {std::array<Index, 6>{1, 1, 1, 1, 1, 1},
                                           {1, 1, 1, 2, 3, 3},
                                           {2, 5, 7, 3, 24, 3},
                                           {1, 9, 4, 17, 5, 5},
                                           {3, 6, 33, 8, 16, 3},
                                           {1, 40, 31, 12, 33, 3},
                                           {1, 8, 8, 70, 64, 1},
                                           {1, 2, 130, 3, 7, 3}})
      for (Activation act : {Activation::none, Activation::relu}) {
        CAPTURE(N, H, W, C, O, K);
        const auto x = uniform<float>({N, H, W, C}, -1, 1, 1), w = uniform<float>({K, K, C, O}, -1, 1, 2),
                   b = uniform<float>({O}, -1, 1, 3);
        const Result got = run(x, w, b, act), want = plain(x, w, b, act);
        CHECK(error(got.y, want.y) < 1e-6);
        CHECK(error(got.dx, want.dx) < 1e-6);
        CHECK(error(got.dw, want.dw) < 3e-6);  // a sum over up to 1,240 pixels: 1.5e-6 measured
        CHECK(error(got.db, want.db) < 1e-6);
      }
  });
}

TEST_CASE("conv2d: gradient") {
  const GradcheckFn f = [](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2]); };
  expect_grad(f, {uniform({2, 3, 4, 2}, -1, 1, 1), uniform({3, 3, 2, 3}, -1, 1, 2), uniform({3}, -1, 1, 3)});
  expect_grad(f, {uniform({1, 1, 1, 1}, -1, 1, 1), uniform({1, 1, 1, 1}, -1, 1, 2), uniform({1}, -1, 1, 3)});
  expect_grad(f, {uniform({0, 3, 4, 2}, -1, 1, 1), uniform({3, 3, 2, 3}, -1, 1, 2), uniform({3}, -1, 1, 3)});
  const GradcheckFn relu = [](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2], Activation::relu); };
  expect_grad(relu,
              {uniform({1, 4, 3, 2}, 0.1, 1, 1), uniform({3, 3, 2, 3}, 0.1, 1, 2), uniform({3}, 0, 1, 3)});
}

TEST_CASE("conv2d: errors") {
  Tape<float> tape;
  const Tensor<float> x({1, 4, 4, 3}), even({2, 2, 3, 5}), w({3, 3, 2, 5}), b({5});
  CHECK_THROWS_WITH(conv2d(tape.constant(x), tape.constant(even), tape.constant(b)),
                    "[conv2d] w: axis 0 must be odd (a centred window), got shape [2, 2, 3, 5]");
  CHECK_THROWS_WITH(conv2d(tape.constant(x), tape.constant(w), tape.constant(b)),
                    Contains("[conv2d] w: axis 2 must be 3"));
}

TEST_CASE("conv2d: same bits for 1 and 2 threads, also where the sum over pixels is split") {
  const auto x = uniform<float>({2, 80, 33, 5}, -1, 1, 1), w = uniform<float>({3, 3, 5, 9}, -1, 1, 2),
             b = uniform<float>({9}, -1, 1, 3);
  const int before = threads();
  set_threads(1);
  const Result one = run(x, w, b, Activation::relu);
  set_threads(2);
  CHECK(one == run(x, w, b, Activation::relu));
  set_threads(before);
}
