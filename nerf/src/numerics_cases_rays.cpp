#include <fieldmark/nerf/composite.h>
#include <fieldmark/nerf/numerics_cases.h>
#include <fieldmark/nerf/space.h>

#include <algorithm>
#include <cmath>

#include "hierarchical_sampler.h"

namespace fieldmark::nerf {
namespace {

using Real = long double;

// One ray by the definition, and the magnitudes of the terms whose difference a gradient is.
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

// Compares colour and opacity relative to the ray's opacity, and gradients relative to the largest terms of
// their kind.
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

// Compares with the definition, the interval that holds a share u of all mass, from sums in long double. The
// error is relative to the length of the ray.
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

// Compares the contraction of p = 1/2 + y / 4 with its formula; in double through Space, whose inner cube is
// [-1, 1].
template <class T>
void compare_contraction(Real size, std::uint64_t seed, WorstError& error) {
  const auto y = scattered<T>({60, 3}, -1, 1, seed).data;
  for (std::size_t i = 0; i < y.size(); i += 3) {
    T p[3], got[3];
    Real s = 0, exact[3];
    for (std::size_t a = 0; a < 3; ++a) p[a] = static_cast<T>(T(0.5) + static_cast<T>(size) * y[i + a] / 4);
    for (std::size_t a = 0; a < 3; ++a) {
      exact[a] = 4 * (static_cast<Real>(p[a]) - Real(0.5));
      s = std::max(s, std::abs(exact[a]));
    }
    const Real scale = s <= 1 ? Real(0.25) : (2 - 1 / s) / (4 * s);
    if constexpr (std::is_same_v<T, float>) {
      contract(p, got);
    } else {
      const Space space{.kind = SpaceKind::contracted, .bounds = {.corner = {-1, -1, -1}, .side = 2}};
      const Vec3 x = space.to_cube({4 * (p[0] - 0.5), 4 * (p[1] - 0.5), 4 * (p[2] - 0.5)});
      std::copy(x.begin(), x.end(), got);
    }
    for (std::size_t a = 0; a < 3; ++a) {
      error.compare(got[a], Real(0.5) + scale * exact[a], 1);
      error.equal(got[a] >= 0 && got[a] <= 1, true);
    }
  }
}

// Compares the direction of a ray's image with the difference of two points' images in long double. The
// camera looks along (sideways, 0, -forward) from behind the plane; rays are float at any precision.
void compare_device_direction(double sideways, double forward, WorstError& error) {
  const Space space{.kind = SpaceKind::ndc, .near = 1, .slope_x = 0.6, .slope_y = 0.8};
  const Vec3 eye{0.3, -0.2, -2};
  const Camera camera = make_camera(look_at(eye, {0.3 + sideways, -0.2, -2 - forward}, {0, 1, 0}), 0.5, 8, 8);
  const float pixels[] = {3.5f, 3.5f, 0, 7, 6, 1};
  CubeRays rays;
  rays.resize(3);
  rays.set(space, 0, camera, pixels);
  for (std::size_t i = 0; i < 9; i += 3) {
    const auto image = [&](Real t, std::size_t a) {
      const auto at = [&](std::size_t k) { return Real(eye[k]) + t * Real(rays.seen_from[i + k]); };
      if (a == 2) return 1 + Real(space.near) / at(2);
      return Real(0.5) - Real(a == 0 ? space.slope_x : space.slope_y) * at(a) / at(2);
    };
    Real along[3], length = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      along[a] = image(Real(0.01), a) - image(0, a);
      length += along[a] * along[a];
    }
    for (std::size_t a = 0; a < 3; ++a)
      error.compare(rays.directions[i + a], along[a] / std::sqrt(length), 1);
  }
}

void add_composite(std::vector<NumericsCase>& cases) {
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

void add_importance(std::vector<NumericsCase>& cases) {
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

void add_space(std::vector<NumericsCase>& cases) {
  const auto contraction = [&](const char* what, Real least, Real most) {
    add_numerics(cases, std::string("space: contraction ") + what, "cube side", 1.5e-7, 3e-16,
                 [=](auto t, WorstError& e) {
                   for (Real size = least; size <= most; size *= 10)
                     compare_contraction<decltype(t)>(size, 5, e);
                 });
  };
  contraction("inside and about the inner cube", 1e-6L, 10);
  contraction("up to 1e15 times as far", 100, 1e15L);
  const auto device = [&](const char* what, double sideways, double forward) {
    add_numerics(cases, std::string("space: device coordinates, ") + what, "1", 1.2e-7, 1.2e-7,
                 [=](auto, WorstError& e) { compare_device_direction(sideways, forward, e); });
  };
  device("rays straight ahead", 0, 1);
  device("rays parallel to the plane", 1, 0);
  device("rays back towards the plane", 1, -0.2);
  device("rays off the axis by 1e-6", 1e-6, 1);
}

}  // namespace

void add_ray_numerics(std::vector<NumericsCase>& cases) {
  add_composite(cases);
  add_importance(cases);
  add_space(cases);
}

}  // namespace fieldmark::nerf
