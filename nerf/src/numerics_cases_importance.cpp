#include <fieldmark/nerf/importance_points.h>

#include <algorithm>
#include <cmath>

#include "numerics_cases_parts.h"

namespace fieldmark::nerf {
namespace {

using Real = long double;

// By the definition: the interval that holds a share u of all mass, from sums in long double. Relative to the
// length of the ray.
template <class T>
void compare_points(const std::vector<T>& edge, const std::vector<T>& weight, Index points,
                    WorstError& error) {
  const std::size_t n = weight.size();
  std::vector<T> u(static_cast<std::size_t>(points)), got(u.size());
  for (std::size_t j = 0; j < u.size(); ++j) u[j] = (static_cast<T>(j) + T(0.5)) / static_cast<T>(points);
  importance_points<T>(edge, weight, u, got);

  const Real length = static_cast<Real>(edge[n]) - edge[0];
  std::vector<Real> below(n + 1);
  for (std::size_t i = 0; i < n; ++i)
    below[i + 1] = below[i] + weight[i] + 3e-4L * (static_cast<Real>(edge[i + 1]) - edge[i]) / length;
  for (std::size_t j = 0; j < u.size(); ++j) {
    const Real want = u[j] * below[n];
    const auto above = std::lower_bound(below.begin() + 1, below.end(), want);
    const auto i = static_cast<std::size_t>(above - below.begin()) - 1;
    const Real part = (want - below[i]) / (below[i + 1] - below[i]);
    error.compare(got[j], edge[i] + part * (static_cast<Real>(edge[i + 1]) - edge[i]), length);
    error.equal(got[j] >= edge[0] && got[j] <= edge[n] && (j == 0 || got[j] >= got[j - 1]), true);
  }
}

template <class T>
std::vector<T> rising(std::size_t n, std::uint64_t seed) {
  std::vector<T> edge{T(0.1)};
  for (const T v : scattered<T>({static_cast<Index>(n)}, 0.01, 1, seed).data) edge.push_back(edge.back() + v);
  return edge;
}

}  // namespace

void add_importance_numerics(std::vector<NumericsCase>& cases) {
  const auto add = [&](const char* what, auto weight_of) {
    add_numerics(cases, std::string("importance_points: ") + what, "length of the ray", 6e-8, 4e-15,
                 [=](auto t, WorstError& e) {
                   using T = decltype(t);
                   for (const std::size_t n : {std::size_t{1}, std::size_t{32}, std::size_t{1024}}) {
                     std::vector<T> weight(n);
                     for (std::size_t i = 0; i < n; ++i) weight[i] = static_cast<T>(weight_of(i, n));
                     compare_points<T>(rising<T>(n, n), weight, 128, e);
                   }
                 });
  };
  add("weights of zero", [](std::size_t, std::size_t) { return 0.0; });
  add("one weight among zeros", [](std::size_t i, std::size_t n) { return i == n / 3 ? 1.0 : 0.0; });
  add("equal weights", [](std::size_t, std::size_t n) { return 1.0 / static_cast<double>(n); });
  add("weights from 1e-30 to 1",
      [](std::size_t i, std::size_t) { return std::pow(10, -static_cast<double>(i % 31)); });
}

}  // namespace fieldmark::nerf
