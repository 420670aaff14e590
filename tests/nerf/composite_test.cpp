#include <fieldmark/nerf/composite.h>

#include <algorithm>
#include <cmath>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
using Offsets = std::vector<Index>;

auto op(const Offsets& ray_begin) {
  return
      [&ray_begin](auto&, auto v) { return composite(v[0], v[1], v[2], std::span<const Index>(ray_begin)); };
}

// One ray by the definition, in long double, and how large the terms are whose difference a gradient is.
struct Exact {
  long double out[4] = {0, 0, 0, 0};
  std::vector<long double> ds, dd;
  long double ds_scale = 1e-30L, dd_scale = 1e-30L;
};
template <class T>
Exact exact_ray(const std::vector<T>& sigma, const std::vector<T>& rgb, const std::vector<T>& delta,
                const T* g) {
  const std::size_t n = sigma.size();
  std::vector<long double> s(sigma.begin(), sigma.end()), d(delta.begin(), delta.end()), before(n + 1), w(n),
      G(n);
  Exact e;
  for (std::size_t i = 0; i < n; ++i) {
    before[i + 1] = before[i] + s[i] * d[i];
    w[i] = -std::exp(-before[i]) * std::expm1(-s[i] * d[i]);
    G[i] = static_cast<long double>(g[3]);
    for (std::size_t k = 0; k < 3; ++k) {
      e.out[k] += w[i] * static_cast<long double>(rgb[3 * i + k]);
      G[i] += static_cast<long double>(g[k]) * static_cast<long double>(rgb[3 * i + k]);
    }
    e.out[3] += w[i];
  }
  long double suffix = 0, suffix_size = 0;
  e.ds.resize(n), e.dd.resize(n);
  for (std::size_t i = n; i-- > 0;) {
    const long double dx = std::exp(-before[i + 1]) * G[i] - suffix;
    const long double size = std::exp(-before[i + 1]) * std::abs(G[i]) + suffix_size;
    e.ds[i] = dx * d[i];
    e.dd[i] = dx * s[i];
    e.ds_scale = std::max(e.ds_scale, size * d[i]);
    e.dd_scale = std::max(e.dd_scale, size * s[i]);
    suffix += w[i] * G[i];
    suffix_size += w[i] * std::abs(G[i]);
  }
  return e;
}

// Largest error of the op in T: outputs relative to the ray's opacity, gradients to the largest terms of
// their kind.
template <class T>
double worst_error(const std::vector<T>& sigma, const std::vector<T>& delta) {
  const auto n = static_cast<Index>(sigma.size());
  const auto rgb = uniform<T>({n, 3}, 0.1, 1, 5);
  const Offsets ray_begin{0, n};
  const auto got = run_op<T>(op(ray_begin), {{Shape{n}, sigma}, rgb, {Shape{n}, delta}});
  const auto g = uniform<T>({4}, -1, 1, 99);  // run_op's cotangent
  const Exact want = exact_ray(sigma, rgb.data, delta, g.data.data());
  long double worst = 0;
  const auto judge = [&](T value, long double exact, long double scale) {
    const long double off = std::abs(static_cast<long double>(value) - exact) / scale;
    worst = off <= worst ? worst : off;  // a NaN stays
  };
  for (std::size_t k = 0; k < 4; ++k) judge(got[0][k], want.out[k], want.out[3]);
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    judge(got[1][i], want.ds[i], want.ds_scale);
    judge(got[3][i], want.dd[i], want.dd_scale);
  }
  return static_cast<double>(worst);
}
}  // namespace

TEST_CASE("composite: sigma * delta from 1e-12 to 1e6, alone and with thin samples around") {
  for (double x = 1e-12; x < 2e6; x *= 10) {
    CAPTURE(x);
    CHECK(worst_error<double>({x}, {1}) < 1e-15);
    CHECK(worst_error<float>({static_cast<float>(x)}, {1}) < 3e-7);
    CHECK(worst_error<double>({0.01, x, 0.5, 0.02, x, 3}, {1, 1, 1, 1, 1, 1}) < 2e-15);
    CHECK(worst_error<float>({0.01f, static_cast<float>(x), 0.5f, 0.02f, static_cast<float>(x), 3},
                             {1, 1, 1, 1, 1, 1}) < 1e-6);
  }
}

TEST_CASE("composite: opacity of a ray of 1e-12 is 1e-12 in float, not 0") {
  const Offsets ray_begin{0, 2};
  const auto y = op_values<float>(
      op(ray_begin),
      {Tensor<float>(Shape{2}, 1e-12f), Tensor<float>(Shape{2, 3}, 1.f), Tensor<float>(Shape{2}, 0.5f)});
  CHECK(std::abs(y[3] / 1e-12f - 1) < 2e-7f);
}

TEST_CASE("composite: empty rays and rays of zero density are transparent") {
  const Offsets ray_begin{0, 0, 3, 3, 5, 5};
  Tensor<double> sigma(Shape{5}), delta(Shape{5}, 0.1);
  sigma[3] = 2;
  const auto y = op_values<double>(op(ray_begin), {sigma, Tensor<double>(Shape{5, 3}, 0.5), delta});
  for (std::size_t k : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19}) CHECK(y[k] == 0);
  CHECK(std::abs(y[15] + std::expm1(-0.2)) < 1e-16);
  expect_grad(op(ray_begin), {sigma, uniform({5, 3}, 0, 1, 2), delta});
}

TEST_CASE("composite: a saturated ray is opaque, and finite in value and gradient") {
  CHECK(worst_error<float>({1e6f, 1e6f, 1e6f, 1}, {1, 1, 1, 1}) < 1e-6);
  CHECK(worst_error<float>({80, 80, 80, 80}, {1, 1, 1, 1}) < 1e-6);
  CHECK(worst_error<float>({0.1f, 3e38f, 0}, {1, 3e38f, 1}) < 1e-6);  // sigma * delta is infinite
}

TEST_CASE("composite: 4096 samples within 1e-14 (double) and 3e-6 (float)") {
  for (const double density : {1e-6, 1e-3, 0.02, 1.0}) {
    const auto sigma = uniform({4096}, 0, 2 * density, 3);
    CAPTURE(density);
    CHECK(worst_error<double>(sigma.data, std::vector<double>(4096, 1)) < 1e-14);
    CHECK(worst_error<float>(std::vector<float>(sigma.data.begin(), sigma.data.end()),
                             std::vector<float>(4096, 1)) < 3e-6);
  }
}

TEST_CASE("composite: a last interval of 1e10") {
  CHECK(worst_error<float>({0.5f, 0.2f, 0.1f}, {0.1f, 0.1f, 1e10f}) < 1e-6);
  CHECK(worst_error<float>({0.5f, 0.2f, 0}, {0.1f, 0.1f, 1e10f}) < 1e-6);
  CHECK(worst_error<double>({0.5, 0.2, 1e-11}, {0.1, 0.1, 1e10}) < 2e-15);
}

TEST_CASE("composite: gradient in density, colour and spacing") {
  for (const Offsets& ray_begin : {Offsets{0}, Offsets{0, 0}, Offsets{0, 1}, Offsets{0, 3, 3, 8}}) {
    const Index n = ray_begin.back();
    expect_grad(op(ray_begin), {uniform({n}, 0, 4, 1), uniform({n, 3}, 0, 1, 2), uniform({n}, 0.05, 1, 3)});
  }
}

TEST_CASE("composite: gradient where only one input needs it") {
  const Offsets b{0, 2, 5};
  const auto sigma = uniform({5}, 0, 4, 1), rgb = uniform({5, 3}, 0, 1, 2), delta = uniform({5}, 0.05, 1, 3);
  const std::span<const Index> s(b);
  expect_grad([&](auto& t, auto v) { return composite(v[0], t.constant(rgb), t.constant(delta), s); },
              {sigma});
  expect_grad([&](auto& t, auto v) { return composite(t.constant(sigma), v[0], t.constant(delta), s); },
              {rgb});
  expect_grad([&](auto& t, auto v) { return composite(t.constant(sigma), t.constant(rgb), v[0], s); },
              {delta});
}

TEST_CASE("composite: errors name argument, expectation and what came") {
  Tape<float> t;
  const auto run = [&](Shape sigma, Shape rgb, Shape delta, const Offsets& b) {
    const Tensor<float> x(sigma), c(rgb), d(delta);
    composite(t.constant(x), t.constant(c), t.constant(d), std::span<const Index>(b));
  };
  CHECK_THROWS_WITH(run({2, 1}, {2, 3}, {2}, {0, 2}),
                    "[composite] sigma must have rank 1 [S], got shape [2, 1]");
  CHECK_THROWS_WITH(run({2}, {3, 3}, {2}, {0, 2}),
                    "[composite] rgb: axis 0 must be 2 (the samples of sigma), got shape [3, 3]");
  CHECK_THROWS_WITH(run({2}, {2, 4}, {2}, {0, 2}),
                    "[composite] rgb: axis 1 must be 3 (red, green, blue), got shape [2, 4]");
  CHECK_THROWS_WITH(run({2}, {2, 3}, {1}, {0, 2}),
                    "[composite] delta: axis 0 must be 2 (the samples of sigma), got shape [1]");
  CHECK_THROWS_WITH(run({2}, {2, 3}, {2}, {0, 1}),
                    "[composite] ray_begin must end at the sample count 2, got 1");
  CHECK_THROWS_WITH(run({2}, {2, 3}, {2}, {}), Contains("must end at the sample count 2, got no offsets"));
  CHECK_THROWS_WITH(run({2}, {2, 3}, {2}, {1, 2}), "[composite] ray_begin must start at 0 and not decrease");
  CHECK_THROWS_WITH(run({2}, {2, 3}, {2}, {0, 2, 1, 2}), Contains("not decrease"));
}

TEST_CASE("composite: the same bits for one and two threads") {
  Offsets ray_begin(1001);
  for (std::size_t r = 0; r < ray_begin.size(); ++r) ray_begin[r] = static_cast<Index>(r * r % 7 + 5 * r);
  std::sort(ray_begin.begin(), ray_begin.end());
  const Index n = ray_begin.back();
  expect_same_bits(op(ray_begin), {uniform<float>({n}, 0, 4, 1), uniform<float>({n, 3}, 0, 1, 2),
                                   uniform<float>({n}, 0, 1, 3)});
}
