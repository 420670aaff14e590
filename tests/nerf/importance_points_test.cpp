#include <fieldmark/core/error.h>
#include "hierarchical_sampler.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
std::vector<double> points(const std::vector<double>& edge, const std::vector<double>& weight,
                           const std::vector<double>& u) {
  std::vector<double> out(u.size());
  importance_points<double>(edge, weight, u, out);
  return out;
}
std::vector<double> middles(std::size_t n) {
  std::vector<double> u(n);
  for (std::size_t j = 0; j < n; ++j) u[j] = (static_cast<double>(j) + 0.5) / static_cast<double>(n);
  return u;
}
}  // namespace

TEST_CASE("importance_points: shares of points are shares of weight") {
  const auto s = points({0, 1, 3, 4}, {0.2, 0.6, 0.2}, middles(1000));
  std::size_t in[3] = {0, 0, 0};
  for (const double v : s) ++in[v < 1 ? 0 : v < 3 ? 1 : 2];
  CHECK(std::abs(static_cast<double>(in[0]) - 200) <= 1);
  CHECK(std::abs(static_cast<double>(in[1]) - 600) <= 1);
  CHECK(std::abs(static_cast<double>(in[2]) - 200) <= 1);
}

TEST_CASE("importance_points: invert the distribution, by summing it up again") {
  const auto length = uniform({9}, 0.01, 1, 1), weight = uniform({9}, 0, 0.3, 2);
  std::vector<double> edge{0.5};
  double total = 0;
  for (const double l : length.data) edge.push_back(edge.back() + l);
  const double all = edge.back() - edge.front();
  for (std::size_t i = 0; i < 9; ++i) total += weight.data[i] + 3e-4 * length.data[i] / all;
  const auto u = middles(57);
  const auto s = points(edge, weight.data, u);
  for (std::size_t j = 0; j < u.size(); ++j) {
    double F = 0;
    for (std::size_t i = 0; i < 9; ++i) {
      const double part = std::clamp((s[j] - edge[i]) / length.data[i], 0.0, 1.0);
      F += part * (weight.data[i] + 3e-4 * length.data[i] / all);
    }
    CHECK(std::abs(F / total - u[j]) < 1e-15 * 20);  // 1e-15 measured
  }
}

TEST_CASE("importance_points: weights of zero give uniform points, in intervals of any length") {
  const auto u = middles(20);
  const auto s = points({0, 0.1, 0.15, 3}, {0, 0, 0}, u);
  for (std::size_t j = 0; j < 20; ++j) CHECK(std::abs(s[j] - 3 * u[j]) < 1e-15 * 10);
}

TEST_CASE("importance_points: one weight takes all points but what the floor moves") {
  const auto s = points({0, 1, 2, 3, 4}, {0, 0, 1, 0}, middles(1000));
  for (const double v : s) CHECK((v >= 2 && v <= 3));
  CHECK(std::abs(s.front() - (2 + 0.0005)) < 3e-4);
}

TEST_CASE("importance_points: the ends of the distribution are the ends of the ray") {
  const auto s = points({1, 2, 4}, {0.5, 0.1}, {0, 1});
  CHECK(s[0] == 1);
  CHECK(std::abs(s[1] - 4) < 1e-15 * 4);
}

TEST_CASE("importance_points: intervals of no length, all of them or one, give points on them") {
  for (const double v : points({2, 2, 2}, {0.3, 0.1}, middles(5))) CHECK(v == 2);
  for (const double v : points({2, 2, 2}, {0, 0}, middles(5))) CHECK(v == 2);
  for (const double v : points({0, 1, 1, 2}, {0, 1, 0}, middles(50))) CHECK((v >= 0 && v <= 2));
}

TEST_CASE("importance_points: errors name sizes") {
  std::vector<double> edge(3), weight(3), u(2), out(1);
  CHECK_THROWS_WITH(
      importance_points<double>(edge, weight, u, out),
      Contains("[importance_points] edge must have one element more than weight") && Contains("got 3 and 3"));
  CHECK_THROWS_WITH(importance_points<double>(edge, std::span(weight).first(2), u, out),
                    "[importance_points] out must have the 2 elements of u, got 1");
  CHECK_THROWS_AS(importance_points<double>(std::span(edge).first(1), {}, {}, {}), ShapeError);
}
