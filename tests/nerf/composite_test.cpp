#include <fieldmark/nerf/composite.h>

#include <algorithm>
#include <cmath>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
using Offsets = std::vector<Index>;

auto composite_op(const Offsets& ray_begin) {
  return
      [&ray_begin](auto&, auto v) { return composite(v[0], v[1], v[2], std::span<const Index>(ray_begin)); };
}
}  // namespace

// numerics_cases compares values and gradients with long double for rays from sigma delta = 1e-12 to
// saturation, with 4096 samples and with a last interval of 1e10.
TEST_CASE("composite: opacity of a ray of 1e-12 is 1e-12 in float, not 0") {
  const Offsets ray_begin{0, 2};
  const auto y = op_values<float>(
      composite_op(ray_begin),
      {Tensor<float>(Shape{2}, 1e-12f), Tensor<float>(Shape{2, 3}, 1.f), Tensor<float>(Shape{2}, 0.5f)});
  CHECK(std::abs(y[3] / 1e-12f - 1) < 2e-7f);
}

TEST_CASE("composite: empty rays and rays of zero density are transparent") {
  const Offsets ray_begin{0, 0, 3, 3, 5, 5};
  Tensor<double> sigma(Shape{5}), delta(Shape{5}, 0.1);
  sigma[3] = 2;
  const auto y = op_values<double>(composite_op(ray_begin), {sigma, Tensor<double>(Shape{5, 3}, 0.5), delta});
  for (std::size_t k : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19}) CHECK(y[k] == 0);
  CHECK(std::abs(y[15] + std::expm1(-0.2)) < 1e-16);
  expect_grad(composite_op(ray_begin), {sigma, uniform({5, 3}, 0, 1, 2), delta});
}

TEST_CASE("composite: a ray by hand") {
  const Offsets ray_begin{0, 2};
  const Tensor<double> sigma(Shape{2}, {0.5, 2}), delta(Shape{2}, {0.4, 0.3}),
      rgb(Shape{2, 3}, {1, 0.5, 0, 0.25, 1, 2});
  const auto y = op_values<double>(composite_op(ray_begin), {sigma, rgb, delta});
  const double w0 = 1 - std::exp(-0.2), w1 = std::exp(-0.2) * (1 - std::exp(-0.6));
  const double want[] = {w0 + 0.25 * w1, 0.5 * w0 + w1, 2 * w1, w0 + w1};
  for (std::size_t k = 0; k < 4; ++k) CHECK(std::abs(y[k] - want[k]) < 2e-16);
}

TEST_CASE("composite: a saturated ray is opaque in every bit") {
  const Offsets ray_begin{0, 2};
  const auto y = op_values<float>(
      composite_op(ray_begin),
      {Tensor<float>(Shape{2}, 1e6f), Tensor<float>(Shape{2, 3}, 1.f), Tensor<float>(Shape{2}, 1.f)});
  CHECK(y == std::vector<float>(4, 1.f));
}

TEST_CASE("composite: gradient in density, colour and spacing") {
  for (const Offsets& ray_begin : {Offsets{0}, Offsets{0, 0}, Offsets{0, 1}, Offsets{0, 3, 3, 8}}) {
    const Index n = ray_begin.back();
    expect_grad(composite_op(ray_begin),
                {uniform({n}, 0, 4, 1), uniform({n, 3}, 0, 1, 2), uniform({n}, 0.05, 1, 3)});
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
  expect_same_bits(composite_op(ray_begin), {uniform<float>({n}, 0, 4, 1), uniform<float>({n, 3}, 0, 1, 2),
                                             uniform<float>({n}, 0, 1, 3)});
}
