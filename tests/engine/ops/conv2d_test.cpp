#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <limits>

#include "engine/ops/conv2d_runs.h"
#include "support/expect_grad.h"

using namespace fieldmark;

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
        const Conv2dResult got = run_conv2d(x, w, b, act), want = plain_conv2d(x, w, b, act);
        CHECK(conv2d_error(got.y, want.y) < 1e-6);
        CHECK(conv2d_error(got.dx, want.dx) < 1e-6);
        CHECK(conv2d_error(got.dw, want.dw) < 3e-6);  // a sum over up to 1,240 pixels: 1.5e-6 measured
        CHECK(conv2d_error(got.db, want.db) < 1e-6);
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
  each_isa([] {
    for (const auto& [C, O] : {std::array<Index, 2>{5, 9}, {24, 40}}) {
      const auto x = uniform<float>({2, 80, 33, C}, -1, 1, 1), w = uniform<float>({3, 3, C, O}, -1, 1, 2),
                 b = uniform<float>({O}, -1, 1, 3);
      const ScopedThreads serial(1);
      const Conv2dResult one = run_conv2d(x, w, b, Activation::relu);
      const ScopedThreads parallel(2);
      CHECK(one == run_conv2d(x, w, b, Activation::relu));
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
      const Conv2dResult all = run_conv2d(x, w, b, Activation::relu),
                         alone = run_conv2d(last, w, b, Activation::relu);
      CAPTURE(side, c);
      CHECK(std::equal(alone.y.begin(), alone.y.end(), all.y.end() - static_cast<Index>(alone.y.size())));
      CHECK(std::equal(alone.dx.begin(), alone.dx.end(), all.dx.end() - static_cast<Index>(alone.dx.size())));
    }
}

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
      const Conv2dResult want = plain_conv2d(x, w, b, {.stride = s, .padding = p}, act);
      each_isa([&] {
        const Conv2dResult got = run_conv2d(x, w, b, ConvWindow{.stride = s, .padding = p}, act);
        REQUIRE(got.y.size() == want.y.size());
        CHECK(conv2d_error(got.y, want.y) < 2e-6);  // 1.04e-6 measured, sums of 2,080 terms
        CHECK(conv2d_error(got.dx, want.dx) < 1e-6);
        CHECK(conv2d_error(got.dw, want.dw) < 1e-6);
        CHECK(conv2d_error(got.db, want.db) < 1e-6);
      });
    }
}

TEST_CASE("conv2d: steps of 1 inside half a window's border are the plain convolution, bit for bit") {
  const auto x = uniform<float>({2, 20, 21, 24}, -1, 1, 1), w = uniform<float>({3, 3, 24, 32}, -1, 1, 2),
             b = uniform<float>({32}, -1, 1, 3);
  CHECK(run_conv2d(x, w, b, ConvWindow{.stride = 1, .padding = 1}, Activation::relu) ==
        run_conv2d(x, w, b, Activation::relu));
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
  CHECK_THROWS_WITH(conv2d(vx, vw, vb, {.stride = 0}), "[conv2d] stride must be 1 to 2147483647, got 0");
  CHECK_THROWS_WITH(conv2d(vx, vw, vb, {.stride = 2, .padding = 1}),
                    "[conv2d] x: height and width must be at least 5 (the window's 7 less two borders of 1), "
                    "got shape [1, 9, 4, 3]");
  const auto image = uniform<float>({2, 83, 90, 3}, -1, 1, 1),
             weights = uniform<float>({11, 11, 3, 64}, -1, 1, 2), bias = uniform<float>({64}, -1, 1, 3);
  const ScopedThreads serial(1);
  const Conv2dResult one =
      run_conv2d(image, weights, bias, ConvWindow{.stride = 4, .padding = 2}, Activation::relu);
  const ScopedThreads parallel(2);
  CHECK(one == run_conv2d(image, weights, bias, ConvWindow{.stride = 4, .padding = 2}, Activation::relu));
}

TEST_CASE("conv2d: windows beyond what can be counted are errors that name the argument") {
  Tape<float> tape;
  const Tensor<float> x({1, 4, 4, 1}), w({3, 3, 1, 1}), b({1});
  const auto vx = tape.constant(x), vw = tape.constant(w), vb = tape.constant(b);
  for (const Index huge : {Index{1} << 31, Index{1} << 62, std::numeric_limits<Index>::max(), Index{-1}}) {
    CAPTURE(huge);
    const auto text = [&](const char* argument, Index least) {
      return std::string("[conv2d] ") + argument + " must be " + std::to_string(least) +
             " to 2147483647, got " + std::to_string(huge);
    };
    CHECK_THROWS_WITH(conv2d(vx, vw, vb, {.stride = huge}), text("stride", 1));
    CHECK_THROWS_WITH(conv2d(vx, vw, vb, {.padding = huge}), text("padding", 0));
    CHECK_THROWS_WITH(conv2d(vx, vw, vb, {.dilation = huge}), text("dilation", 1));
    CHECK_THROWS_WITH(conv2d(vx, vw, vb, {.groups = huge}), text("groups", 1));
    CHECK_THROWS_AS(conv2d(vx, vw, vb, {.padding = huge}), ValueError);
  }
  CHECK_THROWS_WITH(
      conv2d(vx, vw, vb, {.stride = 2147483647, .padding = 2147483647}),
      "[conv2d] padding must leave fewer than 2^60 elements of x with its border, got 2147483647 "
      "for shape [1, 4, 4, 1]");
  CHECK_THROWS_WITH(
      conv2d(vx, vw, vb, {.dilation = 2147483647}),
      "[conv2d] dilation must keep the window within 2147483647 pixels, got 2147483647 for w of "
      "shape [3, 3, 1, 1]");
  CHECK_THROWS_AS(conv2d(vx, vw, vb, {.dilation = 2147483647}), ValueError);
  const Tensor<float> wide({1, 1, 1, 64}), biases({64});
  CHECK_THROWS_WITH(
      conv2d(tape.constant(x), tape.constant(wide), tape.constant(biases), {.padding = 100000000}),
      "[conv2d] padding must leave fewer than 2^60 outputs, got 100000000 for shape [1, 4, 4, 1] and 64 "
      "output channels");
  CHECK(conv2d(vx, vw, vb, {.stride = 2147483647}).shape() == Shape{1, 1, 1, 1});
}
