#include <fieldmark/nerf/composite.h>

#include <algorithm>

#include "numerics_cases_parts.h"

namespace fieldmark::nerf {
namespace {

using Real = long double;

// One ray by the definition, and how large the terms are whose difference a gradient is.
struct Exact {
  Real out[4] = {0, 0, 0, 0};
  std::vector<Real> ds, dd;
  Real ds_scale = 1e-30L, dd_scale = 1e-30L;
};
template <class T>
Exact exact_ray(const Tensor<T>& sigma, const Tensor<T>& rgb, const Tensor<T>& delta, const T* g) {
  const std::size_t n = sigma.data.size();
  std::vector<Real> s(sigma.data.begin(), sigma.data.end()), d(delta.data.begin(), delta.data.end()),
      before(n + 1), w(n), G(n);
  Exact e;
  for (std::size_t i = 0; i < n; ++i) {
    before[i + 1] = before[i] + s[i] * d[i];
    w[i] = -std::exp(-before[i]) * std::expm1(-s[i] * d[i]);
    G[i] = g[3];
    for (std::size_t k = 0; k < 3; ++k) {
      e.out[k] += w[i] * rgb.data[3 * i + k];
      G[i] += static_cast<Real>(g[k]) * rgb.data[3 * i + k];
    }
    e.out[3] += w[i];
  }
  Real suffix = 0, suffix_size = 0;
  e.ds.resize(n), e.dd.resize(n);
  for (std::size_t i = n; i-- > 0;) {
    const Real after = std::exp(-before[i + 1]), dx = after * G[i] - suffix;
    const Real size = after * std::abs(G[i]) + suffix_size;
    e.ds[i] = dx * d[i];
    e.dd[i] = dx * s[i];
    e.ds_scale = std::max(e.ds_scale, size * d[i]);
    e.dd_scale = std::max(e.dd_scale, size * s[i]);
    suffix += w[i] * G[i];
    suffix_size += w[i] * std::abs(G[i]);
  }
  return e;
}

// Colour and opacity relative to the ray's opacity, gradients to the largest terms of their kind.
template <class T>
void compare_ray(const Tensor<T>& sigma, const Tensor<T>& delta, WorstError& error) {
  const auto rgb = scattered<T>({sigma.size(), 3}, 0.1, 1, 5), g = scattered<T>({1, 4}, -1, 1, 6);
  const std::vector<Index> ray_begin{0, sigma.size()};
  const auto got = values_and_gradients<T>(
      [&](auto&, const auto& v) { return composite(v[0], v[1], v[2], std::span<const Index>(ray_begin)); },
      {sigma, rgb, delta}, [&](Shape) -> const Tensor<T>& { return g; });
  const Exact want = exact_ray(sigma, rgb, delta, g.data.data());
  for (std::size_t k = 0; k < 4; ++k)
    error.compare(got[0][k], want.out[k], std::max<Real>(want.out[3], std::numeric_limits<T>::min()));
  for (std::size_t i = 0; i < sigma.data.size(); ++i) {
    error.compare(got[1][i], want.ds[i], want.ds_scale);
    error.compare(got[3][i], want.dd[i], want.dd_scale);
  }
}

template <class T>
void compare_list(const std::vector<double>& sigma, const std::vector<double>& delta, WorstError& error) {
  const Shape s{static_cast<Index>(sigma.size())};
  compare_ray<T>({s, {sigma.begin(), sigma.end()}}, {s, {delta.begin(), delta.end()}}, error);
}

template <class T>
void compare_empty(WorstError& error) {
  const std::vector<Index> ray_begin{0, 0, 3, 3};
  const auto got = values_and_gradients<T>(
      [&](auto&, const auto& v) { return composite(v[0], v[1], v[2], std::span<const Index>(ray_begin)); },
      {Tensor<T>(Shape{3}), scattered<T>({3, 3}, 0, 1, 1), Tensor<T>(Shape{3}, T(0.5))}, ones<T>);
  for (const T v : got[0]) error.equal(v, 0);
  for (const T v : got[2]) error.equal(v, 0);
  for (const T v : got[1]) error.equal(std::isfinite(v), true);
}

}  // namespace

void add_composite_numerics(std::vector<NumericsCase>& cases) {
  const std::string terms = "opacity, largest terms";
  add_numerics(cases, "composite: one sample, sigma delta 1e-12 to 1e6", terms, 2e-7, 4e-16,
               [](auto t, WorstError& e) {
                 for (double x = 1e-12; x < 2e6; x *= 10) compare_list<decltype(t)>({x}, {1}, e);
               });
  add_numerics(cases, "composite: sigma delta 1e-12 to 1e6 among thin samples", terms, 4e-7, 6e-16,
               [](auto t, WorstError& e) {
                 for (double x = 1e-12; x < 2e6; x *= 10)
                   compare_list<decltype(t)>({0.01, x, 0.5, 0.02, x, 3}, {1, 1, 1, 1, 1, 1}, e);
               });
  add_numerics(cases, "composite: saturated rays", terms, 2e-7, 4e-16, [](auto t, WorstError& e) {
    using T = decltype(t);
    const double top = std::numeric_limits<T>::max();
    compare_list<T>({1e6, 1e6, 1e6, 1}, {1, 1, 1, 1}, e);
    compare_list<T>({80, 80, 80, 80}, {1, 1, 1, 1}, e);
    compare_list<T>({0.1, top / 2, 0}, {1, top / 2, 1}, e);  // sigma delta is infinite
  });
  for (const double density : {1e-6, 1e-3, 0.02, 1.0}) {
    char name[80];
    std::snprintf(name, sizeof name, "composite: 4096 samples of mean sigma delta %g", density);
    add_numerics(cases, name, terms, 3e-6, 1e-14, [=](auto t, WorstError& e) {
      using T = decltype(t);
      compare_ray(scattered<T>({4096}, 0, 2 * density, 3), Tensor<T>({4096}, T(1)), e);
    });
  }
  add_numerics(cases, "composite: a last interval of 1e10", terms, 3e-7, 6e-16, [](auto t, WorstError& e) {
    for (const double last : {0.1, 0.0, 1e-11})
      compare_list<decltype(t)>({0.5, 0.2, last}, {0.1, 0.1, 1e10}, e);
  });
  add_numerics(cases, "composite: empty rays and rays of zero density", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_empty<decltype(t)>(e); });
}

}  // namespace fieldmark::nerf
