#include <fieldmark/core/error.h>
#include <fieldmark/watermark/mark/gradcheck_cases.h>
#include <fieldmark/watermark/mark/mark_network.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "support/catch.h"
#include "support/dense_by_loops.h"
#include "support/run_op.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
Row by_loops(const ParamStore<double>& store, const MarkNetworkOptions& o, const Row& x, const Row& c) {
  Row in;
  for (int b = 0; b < o.bands; ++b) {
    for (double v : x) in.push_back(std::sin(std::numbers::pi * std::exp2(b) * v));
    for (double v : x) in.push_back(std::cos(std::numbers::pi * std::exp2(b) * v));
  }
  in.insert(in.end(), c.begin(), c.end());
  Row f = layer(store, "mark/encode/1", layer(store, "mark/encode/0", in, true), true);
  f.insert(f.end(), c.begin(), c.end());
  const Row g = layer(store, "mark/fuse/1", layer(store, "mark/fuse/0", f, true), false);
  const double blue = std::sqrt(1 + 2 * std::pow(114.0 / 886, 2)), red_green = std::hypot(587.0, 299.0);
  const double t = o.tilt * std::numbers::pi / 180, g3 = std::sin(t) / std::sqrt(3), b = std::cos(t) / blue;
  const double rg = g3 - 114.0 / 886 * b, third = g3 + b, norm = std::sqrt(2 * rg * rg + third * third);
  const double axes[3][3] = {
      {rg / norm, rg / norm, third / norm},
      {o.red_green * 587 / red_green, -o.red_green * 299 / red_green, 0},
      {o.luminance / std::sqrt(3), o.luminance / std::sqrt(3), o.luminance / std::sqrt(3)}};
  Row p(3);
  for (int k = 0; k < 3; ++k)
    for (int a = 0; a < 3; ++a)
      p[static_cast<std::size_t>(a)] += std::tanh(g[static_cast<std::size_t>(k)]) * axes[k][a];
  for (std::size_t a = 0; a < 3; ++a) p[a] *= 1 - o.shading + o.shading * c[a];
  return p;
}

template <class T>
auto carrier(const MarkNetwork<T>& net, const ParamStore<T>& store) {
  return [&](auto&, auto v) { return net.carrier(Params<T>(store, nullptr), v[0], v[1]); };
}
}  // namespace

TEST_CASE("mark_network: the carrier is what its formula says") {
  ParamStore<double> store;
  MarkNetworkOptions options{.bands = 3, .features = 5, .red_green = 0.7, .luminance = 0.2};
  SECTION("blue") {}
  SECTION("tilted towards grey") { options.tilt = 50; }
  SECTION("stronger where it is bright") { options.shading = 0.9; }
  const MarkNetwork<double> net(store, "mark", options, 7);
  const auto x = uniform({4, 3}, 0, 1, 1), c = uniform({4, 3}, 0, 1, 2);
  const auto y = op_values(carrier(net, store), std::vector{x, c});
  for (std::size_t i = 0; i < 4; ++i) {
    const auto row = [&](const Tensor<double>& t) {
      return Row(t.data.begin() + 3 * static_cast<long>(i), t.data.begin() + 3 * static_cast<long>(i) + 3);
    };
    const Row want = by_loops(store, net.options(), row(x), row(c));
    for (std::size_t a = 0; a < 3; ++a) CHECK(y[3 * i + a] == Approx(want[a]).margin(1e-12));
  }
}

TEST_CASE("mark_network: without luminance the carrier has no luma, and it is never longer than its axes") {
  ParamStore<double> store;
  const MarkNetwork<double> net(store, "mark", {.red_green = 1, .luminance = 0}, 7);
  for (double& v : store.values()) v *= 5;
  const auto y =
      op_values(carrier(net, store), std::vector{uniform({50, 3}, 0, 1, 1), uniform({50, 3}, 0, 1, 2)});
  double largest = 0;
  for (std::size_t i = 0; i < y.size(); i += 3) {
    CHECK(std::abs(0.299 * y[i] + 0.587 * y[i + 1] + 0.114 * y[i + 2]) < 1e-12);
    raise_to(largest, std::hypot(y[i], y[i + 1], y[i + 2]));
  }
  CHECK(largest <=
        std::sqrt(2 + 2 * 0.05535));  // the two axes are not quite orthogonal: their product is -0.0553
  CHECK(largest > 0.5);
}

TEST_CASE("mark_network: at 90 degrees the carrier is grey, with all shading black carries nothing") {
  ParamStore<double> store;
  const MarkNetwork<double> net(store, "mark", {.tilt = 90, .shading = 1}, 7);
  for (double& v : store.values()) v *= 5;
  const auto x = uniform({50, 3}, 0, 1, 1);
  const auto white = op_values(carrier(net, store), std::vector{x, Tensor<double>({50, 3}, 1.0)});
  for (std::size_t i = 0; i < white.size(); i += 3) {
    CHECK(white[i] != 0);
    CHECK(white[i + 1] == Approx(white[i]).epsilon(1e-12));
    CHECK(white[i + 2] == Approx(white[i]).epsilon(1e-12));
  }
  for (double v : op_values(carrier(net, store), std::vector{x, Tensor<double>({50, 3}, 0.0)})) CHECK(v == 0);
}

TEST_CASE("mark_network: gradients in position, colour and parameters") {
  int found = 0;
  for (const GradcheckCase& c : gradcheck_cases()) {
    if (c.name != "mark_network") continue;
    ++found;
    const GradcheckReport r = c.run();
    INFO(r.table);
    CHECK(r.ok);
    CHECK(r.worst <= 1e-7);
    CHECK(r.entries == 18 + 15 * 4 + 4 + 4 * 4 + 4 + 7 * 4 + 4 + 4 * 3 + 3);
  }
  CHECK(found == 1);
}

TEST_CASE("mark_network: none and one position, one and two threads, float near double") {
  ParamStore<double> exact;
  ParamStore<float> store;
  const MarkNetwork<double> net_double(exact, "mark", {}, 7);
  const MarkNetwork<float> net(store, "mark", {}, 7);
  std::copy(store.values().begin(), store.values().end(), exact.values().begin());
  const auto either = [&](auto&, auto v) {
    if constexpr (std::is_same_v<std::decay_t<decltype(*v[0].value())>, float>)
      return net.carrier(Params<float>(store, nullptr), v[0], v[1]);
    else
      return net_double.carrier(Params<double>(exact, nullptr), v[0], v[1]);
  };
  const std::vector inputs{uniform<float>({700, 3}, 0, 1, 1), uniform<float>({700, 3}, 0, 1, 2)};
  expect_same_bits(either, inputs);
  CHECK(float_error(either, inputs) < 2e-4);  // the finest band multiplies a position's rounding error
  for (Index n : {0, 1}) {
    const std::vector few{Tensor<double>({n, 3}, 0.5), Tensor<double>({n, 3}, 0.5)};
    CHECK(op_values(either, few).size() == static_cast<std::size_t>(3 * n));
  }
}

TEST_CASE("mark_network: errors name what is wrong") {
  const auto make = [](const MarkNetworkOptions& o) {
    ParamStore<float> store;
    const MarkNetwork<float> net(store, "mark", o, 1);
  };
  CHECK_THROWS_AS(make({.bands = 0}), ValueError);
  CHECK_THROWS_WITH(make({.bands = 0}), "[mark_network] bands must be 1 to 12, got 0");
  CHECK_THROWS_WITH(make({.bands = 13}), "[mark_network] bands must be 1 to 12, got 13");
  CHECK_THROWS_WITH(make({.features = 0}), "[mark_network] features must be at least 1, got 0");
  CHECK_THROWS_WITH(make({.tilt = 91}), "[mark_network] tilt must be 0 to 90 degrees, got 91");
  CHECK_THROWS_AS(make({.tilt = std::nan("")}), ValueError);
  CHECK_THROWS_WITH(make({.shading = -0.5}), "[mark_network] shading must be 0 to 1, got -0.5");
  CHECK_THROWS_AS(make({.shading = 1.1}), ValueError);
  CHECK_THROWS_WITH(make({.luminance = 1.5}),
                    "[mark_network] red_green and luminance must be 0 to 1, got 0 and 1.5");
  CHECK_THROWS_AS(make({.red_green = -0.1}), ValueError);
  CHECK_THROWS_AS(make({.luminance = std::nan("")}), ValueError);
}
