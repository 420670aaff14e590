// Tests dilation and groups of conv2d.
#include <fieldmark/engine/ops/conv2d.h>

#include "support/expect_grad.h"
#include "support/run_op.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
// The definition with dilation and groups, in double; values only.
std::vector<double> plain_groups(const std::vector<Tensor<double>>& in, const ConvWindow& g) {
  const Tensor<double>&x = in[0], &w = in[1], &b = in[2];
  const Index H = x.shape[1], W = x.shape[2], C = x.shape[3], K = w.shape[0], O = w.shape[3],
              L = (K - 1) * g.dilation + 1, OH = (H + 2 * g.padding - L) / g.stride + 1,
              OW = (W + 2 * g.padding - L) / g.stride + 1, each = C / g.groups;
  std::vector<double> y(static_cast<std::size_t>(x.shape[0] * OH * OW * O));
  for (std::size_t at = 0; at < y.size(); ++at) {
    const Index k = static_cast<Index>(at), o = k % O, j = k / O % OW, i = k / (O * OW) % OH,
                n = k / (O * OW * OH), first = o / (O / g.groups) * each;
    y[at] = b[o];
    for (Index u = 0; u < K; ++u)
      for (Index v = 0; v < K; ++v)
        for (Index c = 0; c < each; ++c) {
          const Index r = i * g.stride + u * g.dilation - g.padding,
                      s = j * g.stride + v * g.dilation - g.padding;
          if (r >= 0 && r < H && s >= 0 && s < W)
            y[at] += x[((n * H + r) * W + s) * C + first + c] * w[((u * K + v) * each + c) * O + o];
        }
  }
  return y;
}

std::vector<Tensor<double>> grouped_inputs(const ConvWindow& g) {
  return {uniform({2, 7, 8, 4}, -1, 1, 1), uniform({3, 3, 4 / g.groups, 6}, -1, 1, 2),
          uniform({6}, -1, 1, 3)};
}

auto windowed(const ConvWindow& g) {
  return [g](auto&, auto v) { return conv2d(v[0], v[1], v[2], g); };
}

constexpr std::array<ConvWindow, 5> kWindows{{{.padding = 1, .groups = 2},
                                              {.stride = 2, .padding = 2, .dilation = 2},
                                              {.dilation = 3},
                                              {.padding = 3, .dilation = 2, .groups = 2},
                                              {.stride = 3, .groups = 2}}};
}  // namespace

TEST_CASE("conv2d: dilation and groups, values against the definition, and gradients") {
  for (const ConvWindow& g : kWindows) {
    CAPTURE(g.stride, g.padding, g.dilation, g.groups);
    const auto in = grouped_inputs(g);
    const auto want = plain_groups(in, g), got = op_values(windowed(g), in);
    REQUIRE(got.size() == want.size());
    double worst = 0;
    for (std::size_t i = 0; i < got.size(); ++i) raise_to(worst, std::abs(got[i] - want[i]));
    CHECK(worst < 1e-14);
  }
  for (const ConvWindow& g :
       {ConvWindow{.stride = 2, .padding = 1, .dilation = 2}, {.padding = 1, .groups = 2}})
    expect_grad(windowed(g), {uniform({1, 3, 4, 2}, -1, 1, 1), uniform({2, 2, 2 / g.groups, 2}, -1, 1, 2),
                              uniform({2}, -1, 1, 3)});
}

TEST_CASE("conv2d: groups of one channel see that channel alone") {
  const std::vector<Tensor<double>> in{uniform({1, 4, 4, 3}, -1, 1, 1), uniform({3, 3, 1, 3}, -1, 1, 2),
                                       uniform({3}, -1, 1, 3)};
  const auto y = op_values(windowed({.padding = 1, .groups = 3}), in);
  std::vector<Tensor<double>> other = in;
  for (Index i = 0; i < other[0].size(); i += 3) other[0][i] = NAN;
  const auto z = op_values(windowed({.padding = 1, .groups = 3}), other);
  for (std::size_t i = 0; i < y.size(); ++i) CHECK((i % 3 == 0 ? std::isnan(z[i]) : z[i] == y[i]));
}

TEST_CASE("conv2d: errors of dilation and groups, and the same bits for any thread count") {
  Tape<double> tape;
  const Tensor<double> t({1, 7, 8, 4}), weights({3, 3, 2, 6}), bias({6});
  const auto x = tape.constant(t), w = tape.constant(weights), b = tape.constant(bias);
  CHECK_THROWS_WITH(
      conv2d(x, w, b, {.groups = 3}),
      "[conv2d] groups must divide the channels of x and of w, got 3 for shapes [1, 7, 8, 4] and "
      "[3, 3, 2, 6]");
  CHECK_THROWS_WITH(conv2d(x, w, b, {.groups = 1}), Contains("[conv2d] w: axis 2 must be 4"));
  CHECK_THROWS_WITH(conv2d(x, w, b, {.padding = -1, .groups = 2}),
                    Contains("padding must be 0 to 2147483647, got -1"));
  CHECK_THROWS_WITH(conv2d(x, w, b, {.dilation = 4, .groups = 2}),
                    Contains("height and width must be at least 9"));
  // The check comes first: a window of 2000001 x 2000001 pixels would take terabytes.
  CHECK_THROWS_WITH(conv2d(x, w, b, {.dilation = 1000000, .groups = 2}),
                    Contains("height and width must be at least 2000001"));
  CHECK_THROWS_AS(conv2d(x, w, b, {.dilation = 0}), ValueError);
  expect_same_bits(windowed({.padding = 2, .dilation = 2, .groups = 2}),
                   {uniform<float>({2, 40, 50, 4}, -1, 1, 1), uniform<float>({3, 3, 2, 6}, -1, 1, 2),
                    uniform<float>({6}, -1, 1, 3)});
}
