#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>

#include "support/each_isa.h"
#include "support/expect_grad.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
struct Conv2dResult {
  std::vector<float> y, dx, dw, db;
  bool operator==(const Conv2dResult&) const = default;
};

Conv2dResult run(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b, Activation act) {
  Tape<float> tape;
  Tensor<float> dx(x.shape), dw(w.shape), db(b.shape);
  const auto y = conv2d(tape.leaf(x, dx), tape.leaf(w, dw), tape.leaf(b, db), act);
  const std::vector<float> values(y.value(), y.value() + y.shape().size());
  tape.backward(y, values);
  return {values, dx.data, dw.data, db.data};
}

// The definition, in double.
Conv2dResult plain_conv2d(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b,
                          Activation act) {
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
    raise_to(worst, std::abs(double(a[i]) - b[i]));
    raise_to(size, std::abs(double(b[i])));
  }
  return worst / size;
}

// Checks, on every instruction set, the maximum absolute error of a pass over values and gradients, relative
// to the largest magnitude.
void expect_close(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b, Activation act,
                  double most) {
  const Conv2dResult want = plain_conv2d(x, w, b, act);
  each_isa([&] {
    const Conv2dResult got = run(x, w, b, act);
    CHECK(error(got.y, want.y) < most);
    CHECK(error(got.dx, want.dx) < most);
    CHECK(error(got.dw, want.dw) < most);
    CHECK(error(got.db, want.db) < most);
  });
}
}  // namespace

TEST_CASE("conv2d: the float path, forward and all gradients, against the definition") {
  each_isa([] {
    for (const auto& [N, H, W, C, O, K] : {std::array<Index, 6>{1, 1, 1, 1, 1, 1},
                                           {1, 1, 1, 2, 3, 3},
                                           {2, 5, 7, 3, 24, 3},
                                           {1, 9, 4, 17, 5, 5},
                                           {3, 6, 33, 7, 16, 3},
                                           {1, 40, 31, 12, 11, 3},
                                           {1, 1, 130, 16, 16, 3},
                                           {1, 8, 8, 70, 64, 1},
                                           {1, 2, 130, 3, 7, 3}})
      for (Activation act : {Activation::none, Activation::relu}) {
        CAPTURE(N, H, W, C, O, K);
        const auto x = uniform<float>({N, H, W, C}, -1, 1, 1), w = uniform<float>({K, K, C, O}, -1, 1, 2),
                   b = uniform<float>({O}, -1, 1, 3);
        const Conv2dResult got = run(x, w, b, act), want = plain_conv2d(x, w, b, act);
        CHECK(error(got.y, want.y) < 1e-6);
        CHECK(error(got.dx, want.dx) < 1e-6);
        CHECK(error(got.dw, want.dw) < 3e-6);  // a sum over up to 1,240 pixels: 1.5e-6 measured
        CHECK(error(got.db, want.db) < 1e-6);
      }
  });
}

TEST_CASE("conv2d: wide layers with windows of 3 take Winograd's way, against the definition") {
  for (const auto& [N, H, W, C, O] : {std::array<Index, 5>{0, 8, 8, 16, 16},
                                      {3, 3, 13, 9, 17},
                                      {8, 5, 7, 8, 16},
                                      {3, 6, 33, 8, 16},
                                      {1, 2, 130, 16, 20},
                                      {1, 130, 2, 20, 16},
                                      {1, 40, 31, 12, 33},
                                      {2, 20, 20, 31, 31},
                                      {2, 13, 29, 64, 64},
                                      {1, 23, 25, 130, 66}})
    for (Activation act : {Activation::none, Activation::relu}) {
      CAPTURE(N, H, W, C, O);
      const auto x = uniform<float>({N, H, W, C}, -1, 1, 1), w = uniform<float>({3, 3, C, O}, -1, 1, 2),
                 b = uniform<float>({O}, -1, 1, 3);
      expect_close(x, w, b, act, 4e-6);  // 2.5e-6 measured, at 130 channels
    }
  for (Index c = 8; c <= 130; c += 7) {
    const Index o = c < 64 ? 64 : 31;
    CAPTURE(c);
    const auto x = uniform<float>({3, 11, 15, c}, -1, 1, 1), w = uniform<float>({3, 3, c, o}, -1, 1, 2),
               b = uniform<float>({o}, -1, 1, 3);
    expect_close(x, w, b, Activation::relu, 3e-6);  // 2.2e-6 measured
  }
}

TEST_CASE("conv2d: a large offset, a huge pixel and zeros through Winograd's way") {
  const auto w = uniform<float>({3, 3, 24, 32}, -1, 1, 2), b = uniform<float>({32}, -1, 1, 3);
  const auto even = uniform<float>({1, 30, 30, 24}, -1, 1, 1);
  Tensor<float> high = even, spot = even;
  for (float& v : high.data) v += 1000;
  expect_close(high, w, b, Activation::none, 1e-6);  // 5.1e-7 measured

  const Index row = 14, column = 17;
  spot[(row * 30 + column) * 24 + 5] = 1e6f;
  expect_close(spot, w, b, Activation::none, 4e-6);  // 2.8e-6 measured
  const Conv2dResult small = plain_conv2d(even, w, b, Activation::none);
  each_isa([&] {
    // Outputs more than 4 pixels away are unaffected.
    const Conv2dResult got = run(spot, w, b, Activation::none);
    double worst = 0;
    for (Index p = 0; p < 900; ++p)
      if (std::max(std::abs(p / 30 - row), std::abs(p % 30 - column)) > 4)
        for (Index o = 0; o < 32; ++o)
          raise_to(worst, std::abs(double(got.y[p * 32 + o]) - small.y[p * 32 + o]));
    CHECK(worst < 3e-5);  // measured 2.3e-5, for values up to 20

    const Conv2dResult nothing = run(Tensor<float>(even.shape), w, b, Activation::none);
    for (Index i = 0; i < 900 * 32; ++i)
      if (nothing.y[i] != b[i % 32]) FAIL("output " << i << " is not the bias");
    for (float v : nothing.dw)
      if (v != 0) FAIL("a gradient from zeros");
  });
}

TEST_CASE("conv2d: NaN in an image reaches every output that sees it and none more than 4 pixels away") {
  each_isa([] {
    const Index side = 26, c = 16, row = 9;
    const auto w = uniform<float>({3, 3, c, c}, -1, 1, 2), b = uniform<float>({c}, -1, 1, 3);
    for (Activation act : {Activation::none, Activation::relu})
      for (Index column = 0; column < side; ++column) {
        auto x = uniform<float>({1, side, side, c}, -1, 1, 1);
        x[(row * side + column) * c + 3] = std::nanf("");
        const Conv2dResult got = run(x, w, b, act);
        for (Index i = 0; i < side * side * c; ++i) {
          const Index p = i / c, far = std::max(std::abs(p / side - row), std::abs(p % side - column));
          if (far <= 1 && !std::isnan(got.y[i]))
            FAIL("a NaN was lost at pixel " << p << ", column " << column);
          if (far > 4 && !std::isfinite(got.y[i])) FAIL("not finite at pixel " << p << ", column " << column);
        }
      }
  });
}

TEST_CASE("conv2d: gradient through Winograd's way") {
  const auto x = uniform({2, 5, 7, 8}, -1, 1, 1), w = uniform({3, 3, 8, 16}, -1, 1, 2);
  auto b = uniform({16}, -1, 1, 3);
  expect_grad([](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2]); }, {x, w, b});
  // Biases that keep every ReLU well open or shut: finite differences must not step over its kink.
  for (Index o = 0; o < 16; ++o) b[o] += o % 2 == 0 ? 100 : -100;
  expect_grad([](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2], Activation::relu); }, {x, w, b});
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
  each_isa([] {
    for (const auto& [C, O] : {std::array<Index, 2>{5, 9}, {24, 40}}) {
      const auto x = uniform<float>({2, 80, 33, C}, -1, 1, 1), w = uniform<float>({3, 3, C, O}, -1, 1, 2),
                 b = uniform<float>({O}, -1, 1, 3);
      const ScopedThreads serial(1);
      const Conv2dResult one = run(x, w, b, Activation::relu);
      const ScopedThreads parallel(2);
      CHECK(one == run(x, w, b, Activation::relu));
    }
  });
}

TEST_CASE("conv2d: an image alone has the same bits as in a batch") {
  for (Index side : {3, 4, 5, 8, 9, 30})
    for (Index c : {8, 24, 72}) {
      const auto x = uniform<float>({5, side, side, c}, -1, 1, 1),
                 w = uniform<float>({3, 3, c, 64}, -1, 1, 2), b = uniform<float>({64}, -1, 1, 3);
      Tensor<float> last({1, side, side, c});
      std::copy(x.data.end() - last.size(), x.data.end(), last.data.begin());
      const Conv2dResult all = run(x, w, b, Activation::relu), alone = run(last, w, b, Activation::relu);
      CAPTURE(side, c);
      CHECK(std::equal(alone.y.begin(), alone.y.end(), all.y.end() - static_cast<Index>(alone.y.size())));
      CHECK(std::equal(alone.dx.begin(), alone.dx.end(), all.dx.end() - static_cast<Index>(alone.dx.size())));
    }
}

namespace {
// The definition with stride and padding, values and all gradients, in double.
Conv2dResult plain_steps(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b,
                         ConvWindow steps, Activation act) {
  const Index H = x.shape[1], W = x.shape[2], C = x.shape[3], K = w.shape[0], O = w.shape[3],
              s = steps.stride, p = steps.padding, OH = (H + 2 * p - K) / s + 1, OW = (W + 2 * p - K) / s + 1;
  std::vector<double> y(x.shape[0] * OH * OW * O), dx(x.size()), dw(w.size()), db(O);
  for (std::size_t at = 0; at < y.size(); ++at) {
    const Index o = at % O, j = at / O % OW, i = at / (O * OW) % OH, n = at / (O * OW * OH);
    const auto each = [&](auto&& f) {
      for (Index k = 0; k < K * K * C; ++k) {
        const Index r = i * s + k / (K * C) - p, c = j * s + k / C % K - p;
        if (r >= 0 && r < H && c >= 0 && c < W) f(((n * H + r) * W + c) * C + k % C, k * O + o);
      }
    };
    double sum = b[o];
    each([&](Index xi, Index wi) { sum += double(x[xi]) * w[wi]; });
    if (act == Activation::relu) sum = std::max(sum, 0.0);
    y[at] = sum;
    db[o] += sum;
    each([&](Index xi, Index wi) {
      dx[xi] += sum * w[wi];
      dw[wi] += sum * x[xi];
    });
  }
  const auto f = [](const std::vector<double>& v) { return std::vector<float>(v.begin(), v.end()); };
  return {f(y), f(dx), f(dw), f(db)};
}

Conv2dResult run_steps(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b,
                       ConvWindow steps, Activation act) {
  Tape<float> tape;
  Tensor<float> dx(x.shape), dw(w.shape), db(b.shape);
  const auto y = conv2d(tape.leaf(x, dx), tape.leaf(w, dw), tape.leaf(b, db), steps, act);
  const std::vector<float> values(y.value(), y.value() + y.shape().size());
  tape.backward(y, values);
  return {values, dx.data, dw.data, db.data};
}
}  // namespace

TEST_CASE("conv2d: steps and borders, forward and all gradients, against the definition") {
  for (const auto& [N, H, W, C, O, K, s, p] : {std::array<Index, 8>{1, 23, 30, 3, 64, 11, 4, 2},
                                               {2, 15, 17, 3, 20, 3, 2, 0},
                                               {1, 9, 8, 5, 7, 2, 1, 0},
                                               {2, 7, 9, 4, 9, 2, 3, 1},
                                               {1, 4, 4, 2, 3, 1, 5, 0},
                                               {1, 3, 4, 16, 33, 3, 1, 2},
                                               {1, 5, 6, 130, 17, 4, 2, 3},
                                               {1, 1, 1, 1, 1, 3, 1, 1},
                                               {0, 5, 6, 2, 3, 3, 2, 1}})
    for (Activation act : {Activation::none, Activation::relu}) {
      CAPTURE(N, H, W, C, O, K, s, p);
      const auto x = uniform<float>({N, H, W, C}, -1, 1, 1), w = uniform<float>({K, K, C, O}, -1, 1, 2),
                 b = uniform<float>({O}, -1, 1, 3);
      const Conv2dResult want = plain_steps(x, w, b, {.stride = s, .padding = p}, act);
      each_isa([&] {
        const Conv2dResult got = run_steps(x, w, b, {.stride = s, .padding = p}, act);
        REQUIRE(got.y.size() == want.y.size());
        CHECK(error(got.y, want.y) < 2e-6);  // 1.04e-6 measured, sums of 2,080 terms
        CHECK(error(got.dx, want.dx) < 1e-6);
        CHECK(error(got.dw, want.dw) < 1e-6);
        CHECK(error(got.db, want.db) < 1e-6);
      });
    }
}

TEST_CASE("conv2d: steps of 1 inside half a window's border are the plain convolution, bit for bit") {
  const auto x = uniform<float>({2, 20, 21, 24}, -1, 1, 1), w = uniform<float>({3, 3, 24, 32}, -1, 1, 2),
             b = uniform<float>({32}, -1, 1, 3);
  CHECK(run_steps(x, w, b, {.stride = 1, .padding = 1}, Activation::relu) == run(x, w, b, Activation::relu));
}

TEST_CASE("conv2d: gradient with steps and a border") {
  const GradcheckFn f = [](Tape<double>&, auto v) {
    return conv2d(v[0], v[1], v[2], {.stride = 3, .padding = 1});
  };
  for (const Shape s : {Shape{2, 6, 7, 2}, Shape{1, 2, 2, 2}, Shape{0, 6, 7, 2}})
    expect_grad(f, {uniform(s, -1, 1, 1), uniform({4, 4, 2, 3}, -1, 1, 2), uniform({3}, -1, 1, 3)});
}

TEST_CASE("conv2d: errors of steps and borders, and the same bits for any thread count") {
  Tape<float> tape;
  const Tensor<float> x({1, 9, 4, 3}), w({7, 7, 3, 5}), b({5});
  const auto vx = tape.constant(x), vw = tape.constant(w), vb = tape.constant(b);
  CHECK_THROWS_WITH(
      conv2d(vx, vw, vb, {.stride = 0}),
      "[conv2d] stride, dilation and groups must be at least 1 and padding at least 0, got stride 0, "
      "dilation 1, groups 1 and padding 0");
  CHECK_THROWS_WITH(conv2d(vx, vw, vb, {.stride = 2, .padding = 1}),
                    "[conv2d] x: height and width must be at least 5 (the window's 7 less two borders of 1), "
                    "got shape [1, 9, 4, 3]");
  const auto image = uniform<float>({2, 83, 90, 3}, -1, 1, 1),
             weights = uniform<float>({11, 11, 3, 64}, -1, 1, 2), bias = uniform<float>({64}, -1, 1, 3);
  const ScopedThreads serial(1);
  const Conv2dResult one = run_steps(image, weights, bias, {.stride = 4, .padding = 2}, Activation::relu);
  const ScopedThreads parallel(2);
  CHECK(one == run_steps(image, weights, bias, {.stride = 4, .padding = 2}, Activation::relu));
}
