#include <fieldmark/engine/ops/conv_transpose2d.h>

#include "support/expect_grad.h"
#include "support/run_op.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {

struct Sizes {
  Index n = 1, h = 1, w = 1, c = 1, o = 1, k = 1, stride = 1, padding = 0;
};
constexpr std::array<Sizes, 6> kSizes{{{2, 3, 4, 2, 3, 3, 2, 1},
                                       {1, 5, 4, 3, 2, 4, 2, 1},
                                       {1, 2, 3, 9, 20, 2, 3, 0},
                                       {2, 4, 5, 8, 24, 3, 1, 1},
                                       {1, 1, 1, 1, 1, 5, 4, 2},
                                       {0, 3, 3, 2, 2, 3, 1, 0}}};

std::vector<Tensor<double>> inputs(const Sizes& s) {
  return {uniform({s.n, s.h, s.w, s.c}, -1, 1, 1), uniform({s.k, s.k, s.o, s.c}, -1, 1, 2),
          uniform({s.o}, -1, 1, 3)};
}

auto op(const Sizes& s) {
  return [s](auto&, auto v) {
    return conv_transpose2d(v[0], v[1], v[2], {.stride = s.stride, .padding = s.padding});
  };
}

// Adds windows one by one, and sums the gradients of the definition for the cotangent u.
std::vector<std::vector<double>> by_loops(const Sizes& s, const std::vector<Tensor<double>>& in) {
  const Index height = (s.h - 1) * s.stride + s.k - 2 * s.padding,
              width = (s.w - 1) * s.stride + s.k - 2 * s.padding;
  const auto u = uniform({s.n, height, width, s.o}, -1, 1, 99);
  std::vector<std::vector<double>> r{std::vector<double>(u.data.size()),
                                     std::vector<double>(in[0].data.size()),
                                     std::vector<double>(in[1].data.size()), std::vector<double>(at(s.o))};
  for (Index i = 0; i < u.size(); ++i) {
    r[0][at(i)] = in[2][i % s.o];
    r[3][at(i % s.o)] += u[i];
  }
  for (Index x = 0; x < in[0].size(); ++x)
    for (Index q = 0; q < in[1].size(); ++q) {
      if (q % s.c != x % s.c) continue;
      const Index pixel = x / s.c, tap = q / (s.c * s.o), o = q / s.c % s.o;
      const Index i = pixel / s.w % s.h * s.stride + tap / s.k - s.padding,
                  j = pixel % s.w * s.stride + tap % s.k - s.padding;
      if (i < 0 || i >= height || j < 0 || j >= width) continue;
      const Index y = ((pixel / (s.w * s.h) * height + i) * width + j) * s.o + o;
      r[0][at(y)] += in[0][x] * in[1][q];
      r[1][at(x)] += u[y] * in[1][q];
      r[2][at(q)] += u[y] * in[0][x];
    }
  return r;
}

}  // namespace

TEST_CASE("conv_transpose2d: values and gradients against windows added one by one") {
  for (const Sizes& s : kSizes) {
    CAPTURE(s.n, s.h, s.w, s.c, s.o, s.k, s.stride, s.padding);
    const auto in = inputs(s);
    const auto want = by_loops(s, in), got = run_op(op(s), in);
    REQUIRE(got.size() == want.size());
    for (std::size_t k = 0; k < got.size(); ++k) {
      REQUIRE(got[k].size() == want[k].size());
      double worst = 0;
      for (std::size_t i = 0; i < got[k].size(); ++i) raise_to(worst, std::abs(got[k][i] - want[k][i]));
      CHECK(worst < 1e-13);
    }
  }
}

TEST_CASE("conv_transpose2d: it is the gradient of conv2d in its input") {
  const auto x = uniform({1, 3, 4, 2}, -1, 1, 1), w = uniform({3, 3, 5, 2}, -1, 1, 2);
  const Tensor<double> zero({2}), none({5}), image({1, 5, 7, 5});
  Tensor<double> gradient(image.shape);
  Tape<double> tape;
  const ConvWindow window{.stride = 2, .padding = 1};
  const auto wv = tape.constant(w);
  tape.backward(conv2d(tape.leaf(image, gradient), wv, tape.constant(zero), window), x.data);
  const auto y = conv_transpose2d(tape.constant(x), wv, tape.constant(none), window);
  CHECK(y.shape() == image.shape);
  CHECK(std::equal(gradient.data.begin(), gradient.data.end(), y.value()));
}

TEST_CASE("conv_transpose2d: gradient") {
  for (const std::size_t k : {0, 1, 4, 5}) expect_grad(op(kSizes[k]), inputs(kSizes[k]));
}

TEST_CASE("conv_transpose2d: errors") {
  Tape<double> tape;
  const Tensor<double> t({1, 3, 4, 2}), weights({3, 3, 5, 2}), bias({5}), few({4}), other({3, 3, 2, 5}),
      nothing({1, 0, 4, 2});
  const auto x = tape.constant(t), w = tape.constant(weights), b = tape.constant(bias);
  CHECK_THROWS_WITH(
      conv_transpose2d(x, tape.constant(other), b),
      "[conv_transpose2d] w: axis 3 must be 2 (the channels of x, whose shape is [1, 3, 4, 2]), "
      "got shape [3, 3, 2, 5]");
  CHECK_THROWS_WITH(conv_transpose2d(x, w, tape.constant(few)),
                    "[conv_transpose2d] b: axis 0 must be 5 (the outputs of w, whose shape is [3, 3, 5, 2]), "
                    "got shape [4]");
  CHECK_THROWS_WITH(
      conv_transpose2d(x, w, b, {.padding = 3}),
      "[conv_transpose2d] x: a padding of 3 leaves no pixel of the result, got shape [1, 3, 4, 2]");
  CHECK_THROWS_WITH(conv_transpose2d(tape.constant(nothing), w, b),
                    "[conv_transpose2d] x must have at least one pixel, got shape [1, 0, 4, 2]");
  CHECK_THROWS_WITH(conv_transpose2d(x, w, b, {.stride = 0}),
                    "[conv_transpose2d] stride must be 1 to 2147483647, got 0");
  CHECK_THROWS_WITH(conv_transpose2d(x, w, b, {.stride = Index{1} << 62}),
                    "[conv_transpose2d] stride must be 1 to 2147483647, got 4611686018427387904");
  CHECK_THROWS_WITH(conv_transpose2d(x, w, b, {.padding = Index{1} << 62}),
                    "[conv_transpose2d] padding must be 0 to 2147483647, got 4611686018427387904");
  CHECK_THROWS_WITH(conv_transpose2d(x, w, b, {.stride = 2147483647, .padding = 2147483647}),
                    "[conv_transpose2d] stride must leave fewer than 2^60 elements of the result with its "
                    "border, got 2147483647 for shape [1, 3, 4, 2]");
  CHECK_THROWS_AS(conv_transpose2d(x, w, b, {.stride = 2147483647}), ValueError);
  CHECK_THROWS_WITH(conv_transpose2d(x, w, b, {.groups = 2}),
                    "[conv_transpose2d] dilation and groups must be 1, got dilation 1 and groups 2");
  CHECK_THROWS_AS(conv_transpose2d(x, w, b, {.dilation = Index{1} << 62}), ValueError);
}

TEST_CASE("conv_transpose2d: same bits for any thread count, float near double") {
  const auto x = uniform<float>({2, 31, 20, 8}, -1, 1, 1), w = uniform<float>({4, 4, 12, 8}, -1, 1, 2),
             b = uniform<float>({12}, -1, 1, 3);
  const auto f = op({.stride = 2, .padding = 1});
  expect_same_bits(f, {x, w, b});
  CHECK(float_error(f, {x, w, b}) < 2e-6);
}
