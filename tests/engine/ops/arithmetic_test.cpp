#include <fieldmark/engine/ops/arithmetic.h>

#include <algorithm>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_add = [](auto&, auto v) { return add(v[0], v[1]); };
static const auto f_sub = [](auto&, auto v) { return sub(v[0], v[1]); };
static const auto f_mul = [](auto&, auto v) { return mul(v[0], v[1]); };
static const auto f_scale = [](auto&, auto v) { return scale(v[0], -2.5); };

TEST_CASE("arithmetic: values") {
  const std::vector<Tensor<float>> in{{{2, 2}, {1, -2, 3, 0.5f}}, {{2, 2}, {4, 8, -1, 0}}};
  CHECK(op_values(f_add, in) == std::vector<float>{5, 6, 2, 0.5f});
  CHECK(op_values(f_sub, in) == std::vector<float>{-3, -10, 4, 0.5f});
  CHECK(op_values(f_mul, in) == std::vector<float>{4, -16, -3, 0});
  CHECK(op_values(f_scale, in) == std::vector<float>{-2.5f, 5, -7.5f, -1.25f});
}

TEST_CASE("arithmetic: gradient") {
  for (Shape s : {Shape{0}, Shape{1}, Shape{3, 5}}) {
    CAPTURE(s.str());
    expect_grad(f_add, {uniform(s, -1, 1, 1), uniform(s, -1, 1, 2)});
    expect_grad(f_sub, {uniform(s, -1, 1, 1), uniform(s, -1, 1, 2)});
    expect_grad(f_mul, {uniform(s, -1, 1, 1), uniform(s, -1, 1, 2)});
    expect_grad(f_scale, {uniform(s, -1, 1, 1)});
  }
}

TEST_CASE("arithmetic: gradient where both sides are one value") {
  expect_grad([](Tape<double>&, std::span<const Var<double>> v) { return sub(mul(v[0], v[0]), v[0]); },
              {uniform({7}, -1, 1, 3)});
}

TEST_CASE("arithmetic: float against double for extents of 1 to 130") {
  const auto pairs = [](Index e) {
    return std::vector{uniform<float>({e}, -1, 1, 1), uniform<float>({e}, -1, 1, 2)};
  };
  CHECK(float_error_to_130(f_add, pairs) < 1.2e-7);
  CHECK(float_error_to_130(f_sub, pairs) < 1.2e-7);
  CHECK(float_error_to_130(f_mul, pairs) < 1.2e-7);
  CHECK(float_error_to_130(f_scale, [&](Index e) { return std::vector{pairs(e)[0]}; }) < 1.2e-7);
}

// Computes element by element, with indices that repeat along axes of extent 1.
template <class F>
static std::vector<double> by_indices(const Tensor<double>& a, const Tensor<double>& b, const Shape& shape,
                                      F f) {
  const auto offset = [&](const Shape& s, Index flat) {
    Index at = 0, stride = 1;
    for (int k = 1; k <= shape.rank(); ++k) {
      const Index i = flat % shape[-k];
      flat /= shape[-k];
      if (k > s.rank()) continue;
      if (s[-k] > 1) at += i * stride;
      stride *= s[-k];
    }
    return at;
  };
  std::vector<double> y;
  for (Index i = 0; i < shape.size(); ++i) y.push_back(f(a[offset(a.shape, i)], b[offset(b.shape, i)]));
  return y;
}

TEST_CASE("arithmetic: shapes broadcast as index by index, with gradients") {
  struct Pair {
    Shape a, b, y;
  };
  for (const auto& [sa, sb, sy] :
       {Pair{{2, 3}, {3}, {2, 3}}, Pair{{2, 1}, {1, 3}, {2, 3}}, Pair{{}, {2, 3}, {2, 3}},
        Pair{{4, 1, 3}, {5, 1}, {4, 5, 3}}, Pair{{2, 3, 1, 2}, {1, 4, 1}, {2, 3, 4, 2}},
        Pair{{1, 1}, {1}, {1, 1}}, Pair{{0, 3}, {3}, {0, 3}}, Pair{{1}, {0}, {0}},
        Pair{{2, 1, 2, 1, 2}, {3, 1, 2, 1}, {2, 3, 2, 2, 2}}}) {
    CAPTURE(sa.str(), sb.str());
    // At least an eighth apart: finite differences must not step over the kinks of minimum and maximum.
    auto a = uniform(sa, 0.5, 2, 1), b = uniform(sb, 0.5, 2, 2);
    for (double& v : a.data) v = std::round(4 * v) / 4;
    for (double& v : b.data) v = std::round(4 * v) / 4 + 0.125;
    const auto check = [&, y = sy](auto op, auto f) {
      const std::vector<Tensor<double>> in{a, b};
      const auto g = [&](auto&, auto v) { return op(v[0], v[1]); };
      Tape<double> tape;
      CHECK(op(tape.constant(a), tape.constant(b)).shape() == y);
      const auto got = op_values(g, in), want = by_indices(a, b, y, f);
      REQUIRE(got.size() == want.size());
      for (std::size_t i = 0; i < want.size(); ++i) CHECK(got[i] == Approx(want[i]).epsilon(1e-15));
      expect_grad(g, in);
    };
    check([](auto x, auto z) { return add(x, z); }, [](double x, double z) { return x + z; });
    check([](auto x, auto z) { return sub(x, z); }, [](double x, double z) { return x - z; });
    check([](auto x, auto z) { return mul(x, z); }, [](double x, double z) { return x * z; });
    check([](auto x, auto z) { return div(x, z); }, [](double x, double z) { return x / z; });
    check([](auto x, auto z) { return pow(x, z); }, [](double x, double z) { return std::pow(x, z); });
    check([](auto x, auto z) { return minimum(x, z); }, [](double x, double z) { return std::min(x, z); });
    check([](auto x, auto z) { return maximum(x, z); }, [](double x, double z) { return std::max(x, z); });
  }
}

TEST_CASE("arithmetic: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), b({3, 2});
  const auto x = tape.constant(a), y = tape.constant(b);
  const std::string text =
      "b must broadcast with a, whose shape is [2, 3] (extents equal or 1, counted from the last axis), got "
      "shape [3, 2]";
  CHECK_THROWS_WITH(add(x, y), "[add] " + text);
  CHECK_THROWS_WITH(sub(x, y), "[sub] " + text);
  CHECK_THROWS_WITH(mul(x, y), "[mul] " + text);
  CHECK_THROWS_WITH(div(x, y), "[div] " + text);
  CHECK_THROWS_WITH(pow(x, y), "[pow] " + text);
  CHECK_THROWS_WITH(minimum(x, y), "[minimum] " + text);
  CHECK_THROWS_WITH(maximum(x, y), "[maximum] " + text);
  Tape<double> other;
  CHECK_THROWS_AS(add(x, other.constant(a)), ValueError);
}

TEST_CASE("arithmetic: same bits for any thread count") {
  const std::vector<Tensor<float>> in{uniform<float>({100001}, -1, 1, 1), uniform<float>({100001}, -1, 1, 2)};
  expect_same_bits(f_add, in);
  expect_same_bits(f_sub, in);
  expect_same_bits(f_mul, in);
  expect_same_bits(f_scale, {in[0]});
  // Gradients that sum over broadcast axes.
  expect_same_bits(f_mul, {uniform<float>({3001, 33}, -1, 1, 1), uniform<float>({33}, -1, 1, 2)});
  expect_same_bits(f_mul, {uniform<float>({33, 3001}, -1, 1, 1), uniform<float>({33, 1}, -1, 1, 2)});
  expect_same_bits(f_sub, {uniform<float>({}, -1, 1, 1), uniform<float>({3, 50001}, -1, 1, 2)});
}
