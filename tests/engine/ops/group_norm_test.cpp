#include <fieldmark/engine/ops/group_norm.h>

#include "support/expect_grad.h"
#include "support/run_op.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {

auto with(GroupNormOptions options) {
  return [options](auto&, auto v) { return group_norm(v[0], v[1], v[2], options); };
}

// The formula as written, in long double.
std::vector<double> reference(const Tensor<double>& x, const Tensor<double>& gamma,
                              const Tensor<double>& beta, GroupNormOptions o) {
  const Index pixels = x.shape[1] * x.shape[2], channels = x.shape[3], width = channels / o.groups;
  std::vector<double> y(x.data.size());
  for (Index n = 0; n < x.shape[0]; ++n)
    for (Index g = 0; g < o.groups; ++g) {
      const auto each = [&](auto f) {
        for (Index p = 0; p < pixels; ++p)
          for (Index c = g * width; c < (g + 1) * width; ++c) f((n * pixels + p) * channels + c, c);
      };
      long double mean = 0, var = 0;
      const auto count = static_cast<long double>(pixels * width);
      each([&](Index i, Index) { mean += x[i] / count; });
      each([&](Index i, Index) { var += (x[i] - mean) * (x[i] - mean) / count; });
      each([&](Index i, Index c) {
        const long double v = (x[i] - mean) / std::sqrt(var + o.eps) * gamma[c] + beta[c];
        y[static_cast<std::size_t>(i)] = static_cast<double>(o.relu ? std::max(v, 0.0L) : v);
      });
    }
  return y;
}

template <class T = double>
std::vector<Tensor<T>> inputs(Shape s, double centre = 0.3) {
  return {uniform<T>(s, centre - 1, centre + 1, 1), uniform<T>({s[3]}, 0.5, 1.5, 2),
          uniform<T>({s[3]}, -0.5, 0.5, 3)};
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) raise_to(worst, std::abs(a[i] - b[i]));
  return worst;
}

}  // namespace

TEST_CASE("group_norm: values") {
  for (bool relu : {false, true})
    for (Index groups : {1, 2, 6}) {
      const GroupNormOptions o{.groups = groups, .relu = relu};
      const auto in = inputs({2, 5, 7, 6});
      CHECK(largest_difference(op_values(with(o), in), reference(in[0], in[1], in[2], o)) < 1e-14);
    }
  // Each image has more than one chunk of pixels.
  const auto large = inputs({1, 100, 41, 24});
  const GroupNormOptions o{.groups = 8};
  CHECK(largest_difference(op_values(with(o), large), reference(large[0], large[1], large[2], o)) < 1e-13);
}

TEST_CASE("group_norm: gradient") {
  for (Shape s :
       {Shape{0, 3, 3, 4}, Shape{2, 0, 3, 4}, Shape{1, 1, 1, 4}, Shape{2, 3, 2, 4}, Shape{1, 7, 5, 4}}) {
    CAPTURE(s.str());
    expect_grad(with({.groups = 4}), inputs(s));
    expect_grad(with({.groups = 1}), inputs(s));
  }
  // No input of the ReLU lies within 0.05 of its kink for these numbers.
  auto in = inputs({1, 2, 2, 2});
  in[0].data = {-1, 1, 0.5, -0.7, 1.2, 0.4, -0.6, -0.9};
  in[2].data = {0.1, -0.1};
  for (double v : reference(in[0], in[1], in[2], {.groups = 1})) REQUIRE(std::abs(v) > 0.05);
  expect_grad(with({.groups = 1, .relu = true}), in);
}

TEST_CASE("group_norm: zero variance, constant images, one element") {
  for (Shape s : {Shape{1, 8, 8, 4}, Shape{2, 1, 1, 4}}) {
    for (float level : {0.f, 0.1f, 255.f, 1e6f}) {
      auto in = inputs<float>(s);
      std::fill(in[0].data.begin(), in[0].data.end(), level);
      const auto r = run_op(with({.groups = 4}), in);
      for (std::size_t i = 0; i < r[0].size(); ++i) CHECK(r[0][i] == in[2].data[i % 4]);
      for (float g : r[1]) CHECK(std::isfinite(g));
      for (float g : r[2]) CHECK(g == 0);  // dgamma: all normalised values are 0
    }
  }
}

TEST_CASE("group_norm: float against double on every instruction set") {
  // Measured at v2 and v3: 1.7e-7 for all three.
  CHECK(float_error(with({.groups = 8}), inputs<float>({2, 33, 31, 24})) < 4e-7);
  CHECK(float_error(with({.groups = 3, .relu = true}), inputs<float>({2, 33, 31, 9})) < 4e-7);
  for (bool relu : {false, true})
    CHECK(float_error_to_130(with({.groups = 1, .relu = relu}), [](Index e) {
            return inputs<float>({2, 3, 3, e});
          }) < 3e-6);  // measured 1.3e-6: dx of 18 numbers cancels
  // 1000 +- 1: nothing cancels.
  CHECK(float_error(with({.groups = 8}), inputs<float>({2, 33, 31, 24}, 1000)) < 4e-7);
}

TEST_CASE("group_norm: errors") {
  Tape<double> tape;
  const Tensor<double> x({1, 2, 2, 6}), c({6}), wrong({5}), flat({4, 6});
  const auto v = [&](const Tensor<double>& t) { return tape.constant(t); };
  CHECK_THROWS_WITH(group_norm(v(flat), v(c), v(c)),
                    Contains("[group_norm] x must have rank 4") && Contains("[4, 6]"));
  CHECK_THROWS_WITH(group_norm(v(x), v(wrong), v(c)),
                    Contains("gamma: axis 0 must be 6 (channels of x), got shape [5]"));
  CHECK_THROWS_WITH(group_norm(v(x), v(c), v(wrong)), Contains("beta: axis 0 must be 6"));
  CHECK_THROWS_WITH(group_norm(v(x), v(c), v(c), {.groups = 4}),
                    "[group_norm] groups must divide the 6 channels of x, got 4");
  CHECK_THROWS_WITH(group_norm(v(x), v(c), v(c), {.groups = 2, .eps = 0}),
                    Contains("eps must be above 0, got 0"));
}

TEST_CASE("group_norm: same bits for any thread count") {
  expect_same_bits(with({.groups = 8, .relu = true}), inputs<float>({3, 64, 50, 24}));
}
