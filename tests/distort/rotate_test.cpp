#include <fieldmark/distort/rotate.h>

#include <numbers>

#include "distort/support.h"
#include "support/expect_grad.h"

using namespace fieldmark;
using distort::rotate;

namespace {
constexpr double kQuarter = std::numbers::pi / 2;
const auto turn = [](auto&, auto v) { return rotate(v[0], v[1]); };

template <class T>
void check_quarter_turns() {
  for (Index n : {1, 4, 7}) {
    const auto x = uniform<T>({n, n, 3}, 0, 1, 1);
    CHECK(op_result<T>(turn, {x, number<T>(0)}).data == x.data);
    const auto left = op_result<T>(turn, {x, number<T>(kQuarter)});
    const auto right = op_result<T>(turn, {x, number<T>(-kQuarter)});
    const auto half = op_result<T>(turn, {x, number<T>(2 * kQuarter)});
    for (Index i = 0; i < n; ++i)
      for (Index j = 0; j < n; ++j)
        for (Index c = 0; c < 3; ++c) {
          const auto at = [&](const auto& t, Index r, Index q) { return t[(r * n + q) * 3 + c]; };
          CHECK(at(left, i, j) == at(x, j, n - 1 - i));
          CHECK(at(right, i, j) == at(x, n - 1 - j, i));
          CHECK(at(half, i, j) == at(x, n - 1 - i, n - 1 - j));
        }
  }
}
}  // namespace

TEST_CASE("rotate: quarter turns permute the pixels exactly, 0 changes nothing") {
  check_quarter_turns<float>();
  check_quarter_turns<double>();
}

TEST_CASE("rotate: a constant image stays constant inside, corners take the background") {
  const std::vector<float> grey{0.5f, 0.6f, 0.7f};
  const auto y = op_result<float>([&](auto&, auto v) { return rotate(v[0], v[1], grey); },
                                  {Tensor<float>({41, 41, 3}, 0.3f), number<float>(kQuarter / 3)});
  for (Index i = 0; i < 41; ++i)
    for (Index j = 0; j < 41; ++j)
      if (std::hypot(static_cast<double>(i - 20), static_cast<double>(j - 20)) < 20)
        CHECK(std::abs(y[(i * 41 + j) * 3] - 0.3f) < 1e-7f);
  CHECK(std::equal(grey.begin(), grey.end(), y.data.begin()));
}

TEST_CASE("rotate: a linear ramp turns into the turned ramp") {
  Tensor<double> x({21, 21, 1});
  for (Index i = 0; i < 21; ++i)
    for (Index j = 0; j < 21; ++j)
      x[i * 21 + j] = 0.03 * static_cast<double>(j - 10) + 0.01 * static_cast<double>(i - 10);
  const double a = 0.35;
  const auto y = op_result<double>(turn, {x, number<double>(a)});
  for (Index i = 5; i < 16; ++i)
    for (Index j = 5; j < 16; ++j) {
      const double dx = static_cast<double>(j - 10), dy = static_cast<double>(i - 10);
      const double u = std::cos(a) * dx - std::sin(a) * dy, v = std::sin(a) * dx + std::cos(a) * dy;
      CHECK(y[i * 21 + j] == Approx(0.03 * u + 0.01 * v).margin(1e-14));
    }
}

TEST_CASE("rotate: gradient in image and angle") {
  expect_grad(turn, {uniform({5, 4, 3}, 0, 1, 1), number<double>(0.61)}, {.step = 0.02});
  expect_grad(turn, {uniform({4, 6, 1}, 0, 1, 1), number<double>(-0.4)}, {.step = 0.02});
}

TEST_CASE("rotate: errors and threads") {
  Tape<float> tape;
  const Tensor<float> x({2, 2, 3}), two({2}), nan({1}, std::nanf(""));
  CHECK_THROWS_WITH(rotate(tape.constant(x), tape.constant(two)),
                    "[similarity] angle: axis 0 must be 1 (its layout is [1]), got shape [2]");
  CHECK_THROWS_AS(rotate(tape.constant(x), tape.constant(nan)), ValueError);
  const std::vector<Tensor<float>> in{uniform<float>({120, 110, 3}, 0, 1, 1), number<float>(0.5)};
  CHECK(run_with_grads<float>(turn, in, 1) == run_with_grads<float>(turn, in, 2));
}
