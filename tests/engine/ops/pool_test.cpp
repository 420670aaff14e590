#include <fieldmark/engine/ops/pool.h>

#include "support/expect_grad.h"
#include "support/run_op.h"
#include "support/worst.h"

using namespace fieldmark;

static const auto f_pool2 = [](auto&, auto v) { return avg_pool(v[0], 2); };
static const auto f_global = [](auto&, auto v) { return global_avg_pool(v[0]); };

TEST_CASE("pool: values") {
  // Two channels, 3 x 5 pixels: the last row and column belong to no window.
  Tensor<double> x({2, 3, 5, 2});
  for (Index i = 0; i < x.size(); ++i) x[i] = static_cast<double>(i * i % 23);
  const auto y = op_values(f_pool2, std::vector{x}), all = op_values(f_global, std::vector{x});
  REQUIRE(y.size() == 2 * 1 * 2 * 2);
  for (std::size_t n = 0; n < 2; ++n)
    for (std::size_t c = 0; c < 2; ++c) {
      const auto at = [&](std::size_t i, std::size_t j) { return x.data[((n * 3 + i) * 5 + j) * 2 + c]; };
      for (std::size_t j = 0; j < 2; ++j)
        CHECK(y[(n * 2 + j) * 2 + c] ==
              (at(0, 2 * j) + at(0, 2 * j + 1) + at(1, 2 * j) + at(1, 2 * j + 1)) / 4);
      double sum = 0;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 5; ++j) sum += at(i, j);
      CHECK(all[n * 2 + c] == sum / 15);
    }
}

TEST_CASE("pool: gradient") {
  for (Shape s : {Shape{0, 4, 4, 2}, Shape{1, 1, 1, 1}, Shape{2, 3, 5, 2}, Shape{1, 4, 6, 3}}) {
    CAPTURE(s.str());
    expect_grad(f_pool2, {uniform(s, -1, 1, 1)});
    expect_grad([](auto&, auto v) { return avg_pool(v[0], 1); }, {uniform(s, -1, 1, 1)});
    expect_grad(f_global, {uniform(s, -1, 1, 1)});
  }
}

TEST_CASE("pool: the gradient of dropped pixels is 0 in a buffer that the backward makes itself") {
  Tape<float> tape;
  Tensor<float> x({2, 3, 5, 2}, 1.f), g(x.shape);
  const auto v = tape.leaf(x, g);
  const auto inner = avg_pool(v, 1);  // its gradient buffer is allocated, not given
  const auto y = avg_pool(inner, 2);
  tape.backward(y, std::vector<float>(8, 1.f));
  for (Index i = 0; i < g.size(); ++i) {
    const Index row = i / 10 % 3, column = i / 2 % 5;
    CHECK(g[i] == (row < 2 && column < 4 ? 0.25f : 0.f));
  }
}

TEST_CASE("pool: mean of a million equal float pixels") {
  // Every addition rounds in the same direction, and float sums have 16 terms: measured 1.2e-7.
  const Tensor<float> x({1, 1000, 1000, 1}, 0.1f);
  CHECK(std::abs(op_values(f_global, std::vector{x})[0] / 0.1f - 1) < 3e-7f);
}

TEST_CASE("pool: errors") {
  Tape<double> tape;
  const Tensor<double> x({1, 2, 2, 3}), flat({4, 3}), none({1, 0, 2, 3});
  CHECK_THROWS_WITH(avg_pool(tape.constant(flat), 2), Contains("[avg_pool] x must have rank 4"));
  CHECK_THROWS_WITH(avg_pool(tape.constant(x), 0), "[avg_pool] size must be 1 to 2147483647, got 0");
  CHECK_THROWS_WITH(avg_pool(tape.constant(x), Index{1} << 62),
                    "[avg_pool] size must be 1 to 2147483647, got 4611686018427387904");
  CHECK(avg_pool(tape.constant(x), 2147483647).shape() == Shape{1, 0, 0, 3});
  CHECK_THROWS_WITH(global_avg_pool(tape.constant(flat)), Contains("[global_avg_pool] x must have rank 4"));
  CHECK_THROWS_WITH(global_avg_pool(tape.constant(none)),
                    Contains("at least one pixel, got shape [1, 0, 2, 3]"));
}

TEST_CASE("pool: float against double, and the same bits for any thread count") {
  const auto x = uniform<float>({3, 50, 51, 17}, -1, 1, 1),
             large = uniform<float>({3, 150, 151, 17}, -1, 1, 1);
  expect_same_bits(f_global, {large});
  expect_same_bits(f_pool2, {x});
  expect_same_bits(f_global, {x});
  CHECK(float_error(f_pool2, {x}) < 2e-7);
  const auto of_channels = [](Index e) { return std::vector{uniform<float>({2, 5, 3, e}, -1, 1, 1)}; };
  CHECK(float_error_to_130(f_pool2, of_channels) < 2e-7);
  CHECK(float_error_to_130(f_global, of_channels) < 2e-7);
  CHECK(float_error(f_global, {x}) < 2e-7);
}

namespace {
constexpr MaxPool kWindows[] = {{.size = 3, .stride = 2}, {.size = 3, .stride = 2, .ceil_mode = true},
                                {.size = 2, .stride = 2}, {.size = 2, .stride = 3, .ceil_mode = true},
                                {.size = 3, .stride = 1}, {.size = 1, .stride = 2}};

auto max_of(const MaxPool& windows) {
  return [windows](auto&, auto v) { return max_pool(v[0], windows); };
}

// PyTorch's rule for the number of windows, by counting instead of a formula.
Index count_windows(Index extent, const MaxPool& m) {
  Index count = 0;
  while (count * m.stride + m.size <= extent || (m.ceil_mode && count * m.stride < extent &&
                                                 (count == 0 || (count - 1) * m.stride + m.size < extent)))
    ++count;
  return count;
}
}  // namespace

TEST_CASE(
    "max_pool: values and gradients equal a plain loop, for windows that overlap, leave gaps or reach over "
    "the edge") {
  for (const MaxPool& m : kWindows)
    for (const Shape s : {Shape{2, 7, 8, 3}, Shape{1, 3, 4, 1}, Shape{1, 10, 5, 18}, Shape{0, 4, 4, 2}}) {
      CAPTURE(m.size, m.stride, m.ceil_mode, s.str());
      const auto x = uniform(s, -1, 1, 5);
      const Index height = count_windows(s[1], m), width = count_windows(s[2], m);
      const Shape out{s[0], height, width, s[3]};
      const auto u = uniform(out, -1, 1, 99);
      std::vector<double> want(u.data.size()), gradient(x.data.size());
      for (Index k = 0; k < u.size(); ++k) {
        const Index c = k % s[3], j = k / s[3] % width, i = k / (s[3] * width) % height,
                    n = k / (s[3] * width * height);
        Index best = -1;
        for (Index r = i * m.stride; r < std::min(i * m.stride + m.size, s[1]); ++r)
          for (Index q = j * m.stride; q < std::min(j * m.stride + m.size, s[2]); ++q) {
            const Index at = ((n * s[1] + r) * s[2] + q) * s[3] + c;
            if (best < 0 || x[at] > x[best]) best = at;
          }
        want[static_cast<std::size_t>(k)] = x[best];
        gradient[static_cast<std::size_t>(best)] += u[k];
      }
      const auto got = run_op(max_of(m), std::vector{x});
      CHECK(got[0] == want);
      REQUIRE(got[1].size() == gradient.size());
      double worst = 0;
      for (std::size_t i = 0; i < gradient.size(); ++i) raise_to(worst, std::abs(got[1][i] - gradient[i]));
      CHECK(worst < 1e-15);
    }
}

TEST_CASE("max_pool: the first of equal numbers gets the gradient, NaN and infinities come through") {
  Tensor<float> x({1, 2, 2, 1}, 1.f), g(x.shape);
  Tape<float> tape;
  const auto inner = avg_pool(tape.leaf(x, g), 1);  // its gradient buffer is allocated, not given
  tape.backward(max_pool(inner, {.size = 2, .stride = 1}), std::vector<float>{3});
  CHECK(g.data == std::vector<float>{3, 0, 0, 0});
  for (Index at = 0; at < 4; ++at) {
    x = Tensor<float>({1, 2, 2, 1}, 2.f);
    x[at] = std::nanf("");
    CHECK(std::isnan(op_values(max_of({.size = 2, .stride = 1}), std::vector{x})[0]));
    x[at] = -INFINITY;
    CHECK(op_values(max_of({.size = 2, .stride = 1}), std::vector{x})[0] == 2);
  }
  x.data.assign(4, -INFINITY);
  CHECK(op_values(max_of({.size = 2, .stride = 1}), std::vector{x})[0] == -INFINITY);
}

TEST_CASE("max_pool: gradient") {
  // Numbers a tenth apart: differences of 0.02 change no maximum.
  for (const Shape s : {Shape{0, 4, 4, 2}, Shape{1, 3, 3, 1}, Shape{2, 4, 5, 2}}) {
    CAPTURE(s.str());
    Tensor<double> x(s);
    for (Index i = 0; i < x.size(); ++i) x[i] = 0.1 * static_cast<double>(i * 37 % 101);
    for (const MaxPool& m : kWindows) expect_grad(max_of(m), {x});
  }
}

TEST_CASE("max_pool: errors") {
  Tape<double> tape;
  const Tensor<double> x({1, 2, 5, 3}), flat({4, 3}), none({1, 0, 2, 3});
  CHECK_THROWS_WITH(max_pool(tape.constant(flat), {}), Contains("[max_pool] x must have rank 4"));
  CHECK_THROWS_WITH(max_pool(tape.constant(x), {.size = 0}),
                    "[max_pool] size must be 1 to 2147483647, got 0");
  const Index huge = Index{1} << 62;
  CHECK_THROWS_WITH(max_pool(tape.constant(x), {.size = huge, .ceil_mode = true}),
                    "[max_pool] size must be 1 to 2147483647, got 4611686018427387904");
  CHECK_THROWS_WITH(max_pool(tape.constant(x), {.stride = huge}),
                    "[max_pool] stride must be 1 to 2147483647, got 4611686018427387904");
  CHECK_THROWS_WITH(max_pool(tape.constant(x), {.size = 3}),
                    "[max_pool] x: height and width must be at least 3 (one window), got shape [1, 2, 5, 3]");
  CHECK_THROWS_WITH(max_pool(tape.constant(none), {.ceil_mode = true}),
                    Contains("must be at least 1 (one window)"));
}

TEST_CASE("max_pool: a window of more pixels than float can number is an error, in double it is none") {
  const Tensor<float> long_row({1, (1 << 24) + 1, 1, 1});
  Tape<float> tape;
  CHECK_THROWS_WITH(
      max_pool(tape.constant(long_row), {.size = (1 << 24) + 1, .ceil_mode = true}),
      "[max_pool] size must leave at most 16777216 pixels of x in a window, got 16777217 x 1 for "
      "shape [1, 16777217, 1, 1]");
  // The last pixel of the largest window: its number is the largest that float can tell from its neighbours.
  Tensor<float> largest({1, 1 << 24, 1, 1});
  largest[largest.size() - 1] = 1;
  Tensor<float> dx(largest.shape);
  tape.backward(max_pool(tape.leaf(largest, dx), {.size = 1 << 24, .ceil_mode = true}),
                std::vector<float>{3});
  CHECK(dx[dx.size() - 1] == 3);
  CHECK(dx[dx.size() - 2] == 0);
}

TEST_CASE("max_pool: float against double, and the same bits for any thread count") {
  const auto of_channels = [](Index e) { return std::vector{uniform<float>({2, 6, 7, e}, -1, 1, 1)}; };
  for (const MaxPool& m : kWindows) {
    expect_same_bits(max_of(m), {uniform<float>({3, 50, 51, 17}, -1, 1, 1)});
    CHECK(float_error_to_130(max_of(m), of_channels) < 2e-7);
  }
}

TEST_CASE("max_pool: a window far larger than the image is the image, also for gradients in float") {
  const MaxPool far{.size = 2147483647, .stride = 2147483647, .ceil_mode = true}, whole{5, 5, true};
  const std::vector in{uniform<float>({2, 3, 5, 2}, -1, 1, 1)};
  CHECK(run_op([&](auto&, auto v) { return max_pool(v[0], far); }, in) ==
        run_op([&](auto&, auto v) { return max_pool(v[0], whole); }, in));
}
