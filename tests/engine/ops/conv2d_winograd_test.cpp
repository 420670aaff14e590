#include <fieldmark/engine/ops/conv2d.h>

#include <algorithm>
#include <cmath>

#include "engine/ops/conv2d_runs.h"
#include "support/expect_grad.h"

using namespace fieldmark;

namespace {
// Checks, on every instruction set, the maximum absolute error of a pass over values and gradients, relative
// to the largest magnitude.
void expect_close(const Tensor<float>& x, const Tensor<float>& w, const Tensor<float>& b, Activation act,
                  double most) {
  const Conv2dResult want = plain_conv2d(x, w, b, act);
  each_isa([&] {
    const Conv2dResult got = run_conv2d(x, w, b, act);
    CHECK(conv2d_error(got.y, want.y) < most);
    CHECK(conv2d_error(got.dx, want.dx) < most);
    CHECK(conv2d_error(got.dw, want.dw) < most);
    CHECK(conv2d_error(got.db, want.db) < most);
  });
}
}  // namespace

TEST_CASE("conv2d winograd: wide layers with windows of 3, against the definition") {
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

TEST_CASE("conv2d winograd: a large offset, a huge pixel and zeros") {
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
    const Conv2dResult got = run_conv2d(spot, w, b, Activation::none);
    double worst = 0;
    for (Index p = 0; p < 900; ++p)
      if (std::max(std::abs(p / 30 - row), std::abs(p % 30 - column)) > 4)
        for (Index o = 0; o < 32; ++o)
          raise_to(worst, std::abs(double(got.y[p * 32 + o]) - small.y[p * 32 + o]));
    CHECK(worst < 3e-5);  // measured 2.3e-5, for values up to 20

    const Conv2dResult nothing = run_conv2d(Tensor<float>(even.shape), w, b, Activation::none);
    for (Index i = 0; i < 900 * 32; ++i)
      if (nothing.y[i] != b[i % 32]) FAIL("output " << i << " is not the bias");
    for (float v : nothing.dw)
      if (v != 0) FAIL("a gradient from zeros");
  });
}

TEST_CASE(
    "conv2d winograd: NaN in an image reaches every output that sees it and none more than 4 pixels away") {
  each_isa([] {
    const Index side = 26, c = 16, row = 9;
    const auto w = uniform<float>({3, 3, c, c}, -1, 1, 2), b = uniform<float>({c}, -1, 1, 3);
    for (Activation act : {Activation::none, Activation::relu})
      for (Index column = 0; column < side; ++column) {
        auto x = uniform<float>({1, side, side, c}, -1, 1, 1);
        x[(row * side + column) * c + 3] = std::nanf("");
        const Conv2dResult got = run_conv2d(x, w, b, act);
        for (Index i = 0; i < side * side * c; ++i) {
          const Index p = i / c, far = std::max(std::abs(p / side - row), std::abs(p % side - column));
          if (far <= 1 && !std::isnan(got.y[i]))
            FAIL("a NaN was lost at pixel " << p << ", column " << column);
          if (far > 4 && !std::isfinite(got.y[i])) FAIL("not finite at pixel " << p << ", column " << column);
        }
      }
  });
}

TEST_CASE("conv2d winograd: gradient") {
  const auto x = uniform({2, 5, 7, 8}, -1, 1, 1), w = uniform({3, 3, 8, 16}, -1, 1, 2);
  auto b = uniform({16}, -1, 1, 3);
  expect_grad([](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2]); }, {x, w, b});
  // Biases that keep every ReLU well open or shut: finite differences must not step over its kink.
  for (Index o = 0; o < 16; ++o) b[o] += o % 2 == 0 ? 100 : -100;
  expect_grad([](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2], Activation::relu); }, {x, w, b});
}
