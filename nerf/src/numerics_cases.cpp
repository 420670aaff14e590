#include <fieldmark/nerf/frequency_encoding.h>
#include <fieldmark/nerf/hash_encoding.h>
#include <fieldmark/nerf/numerics_cases.h>

#include <algorithm>
#include <numbers>

#include "hash_reference.h"
#include "marching.h"

namespace fieldmark::nerf {

void add_ray_numerics(std::vector<NumericsCase>& cases);  // numerics_cases_rays.cpp

namespace {

using Real = long double;

// Checks sin and cos of 2^b pi x, b < 16, and the gradient with respect to x, relative to the sum of its
// terms' magnitudes.
template <class T>
void compare_frequency(double far, WorstError& error) {
  constexpr int bands = 16;
  const Index n = 300;
  const auto x = scattered<T>({n, 1}, far, far + std::max(1.0, far / 100), 2),
             g = scattered<T>({n, 2 * bands}, -1, 1, 3);
  const auto got =
      values_and_gradients<T>([](auto&, const auto& v) { return frequency_encoding(v[0], bands); }, {x},
                              [&](Shape) -> const Tensor<T>& { return g; });
  for (Index i = 0; i < n; ++i) {
    Real slope = 0, size = 0;
    for (Index b = 0; b < bands; ++b) {
      const Real scale = std::ldexp(std::numbers::pi_v<Real>, static_cast<int>(b));
      const Real angle =
          std::numbers::pi_v<Real> * std::fmod(std::ldexp(Real{x[i]}, static_cast<int>(b)), Real{2});
      const Index at = 2 * bands * i + 2 * b;
      error.compare(got[0][static_cast<std::size_t>(at)], std::sin(angle), 1);
      error.compare(got[0][static_cast<std::size_t>(at + 1)], std::cos(angle), 1);
      slope += scale * (g[at] * std::cos(angle) - g[at + 1] * std::sin(angle));
      size += scale * (std::abs(g[at]) + std::abs(g[at + 1]));
    }
    error.compare(got[1][static_cast<std::size_t>(i)], slope, size);
  }
}

constexpr HashEncodingOptions kHash{
    .levels = 3, .features = 2, .log2_table = 8, .base_resolution = 4, .finest_resolution = 64};

template <class T>
struct Hash {
  ParamStore<T> store;
  HashEncoding<T> encoding;
  Hash() : encoding(store, "e", kHash, 1) {
    const auto table = scattered<T>({store.size()}, -1, 1, 7);
    std::copy(table.data.begin(), table.data.end(), store.values().begin());
  }
  std::vector<std::vector<T>> run(const Tensor<T>& x, const Tensor<T>& g) {
    store.zero_grad();
    return values_and_gradients<T>(
        [&](auto&, const auto& v) {
          return encoding(Params<T>(store), v[0], HashEncoding<T>::Part::density);
        },
        {x}, [&](Shape) -> const Tensor<T>& { return g; });
  }
};

// Checks values and gradients with respect to positions and table against the paper's formulas, relative to
// the sum of the terms' magnitudes.
template <class T>
void compare_hash(const Tensor<T>& x, WorstError& error) {
  Hash<T> hash;
  const Index n = x.shape[0], width = hash.encoding.width();
  const auto g = scattered<T>({n, width}, -1, 1, 8);
  const auto got = hash.run(x, g);
  const auto table = hash.store.values();
  std::vector<Real> dt(table.size()), dt_size(table.size());
  for (Index i = 0; i < n; ++i) {
    Real dx[3] = {}, dx_size[3] = {};
    Index first = 0;
    for (int l = 0; l < kHash.levels; ++l) {
      const Index cells = hash.encoding.resolution(l), corners = (cells + 1) * (cells + 1) * (cells + 1);
      const Index cap = Index{1} << kHash.log2_table;
      const auto around =
          hash_corners(cells, corners > cap ? cap : 0, {x[3 * i], x[3 * i + 1], x[3 * i + 2]});
      for (Index f = 0; f < 2; ++f) {
        Real value = 0, size = 0;
        const Index out = i * width + 2 * l + f;
        for (const HashCorner& c : around) {
          const auto entry = static_cast<std::size_t>((first + c.row) * 4 + f);
          value += c.weight * table[entry];
          size += std::abs(c.weight * table[entry]);
          dt[entry] += c.weight * g[out];
          dt_size[entry] += std::abs(c.weight * g[out]);
          for (std::size_t a = 0; a < 3; ++a) {
            dx[a] += c.gradient[a] * table[entry] * g[out];
            dx_size[a] += std::abs(c.gradient[a] * table[entry] * g[out]);
          }
        }
        error.compare(got[0][static_cast<std::size_t>(out)], value, size);
      }
      first += corners > cap ? cap : corners;
    }
    for (std::size_t a = 0; a < 3; ++a)
      error.compare(got[1][static_cast<std::size_t>(3 * i) + a], dx[a], dx_size[a]);
  }
  for (std::size_t k = 0; k < dt.size(); ++k)
    error.compare(hash.store.grads()[k], dt[k], std::max(dt_size[k], Real{1e-30L}));
}

// Returns all points with the given coordinates.
template <class T>
Tensor<T> grid(const std::vector<double>& at) {
  Tensor<T> x(Shape{0, 3});
  for (const double a : at)
    for (const double b : at)
      for (const double c : at)
        x.data.insert(x.data.end(), {static_cast<T>(a), static_cast<T>(b), static_cast<T>(c)});
  x.shape = {x.size() / 3, 3};
  return x;
}

// Checks that a NaN makes its own row NaN and affects no other.
template <class T>
void compare_hash_nan(WorstError& error) {
  using Limits = std::numeric_limits<T>;
  Hash<T> hash;
  const auto x = scattered<T>({40, 3}, 0, 1, 9);
  auto bad = x;
  bad[3 * 7] = Limits::quiet_NaN();
  bad[3 * 20 + 1] = Limits::infinity();
  bad[3 * 33 + 2] = -Limits::max();
  const Index width = hash.encoding.width();
  const Tensor<T> g({40, width}, T(1));
  const auto clean = hash.run(x, g), got = hash.run(bad, g);
  for (Index i = 0; i < 40; ++i) {
    const bool spoilt = i == 7 || i == 20 || i == 33;
    for (auto k = static_cast<std::size_t>(i * width); k < static_cast<std::size_t>((i + 1) * width); ++k) {
      if (i == 7) error.equal(got[0][k], Limits::quiet_NaN());
      if (!spoilt) error.equal(got[0][k], clean[0][k]);
    }
    for (auto k = static_cast<std::size_t>(3 * i); !spoilt && k < static_cast<std::size_t>(3 * i + 3); ++k)
      error.equal(got[1][k], clean[1][k]);
  }
}

// Returns the span of a ray in the cube by the definition, in long double; empty if near >= far.
std::pair<Real, Real> exact_span(const float* o, const float* d) {
  Real near = 0, far = std::numeric_limits<Real>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (d[a] == 0 && !(o[a] >= 0 && o[a] <= 1)) return {0, 0};
    if (d[a] == 0) continue;
    const Real t0 = -static_cast<Real>(o[a]) / d[a], t1 = (1 - static_cast<Real>(o[a])) / d[a];
    near = std::max(near, std::min(t0, t1));
    far = std::min(far, std::max(t0, t1));
  }
  return near < far && std::isfinite(far) ? std::pair{near, far} : std::pair<Real, Real>{0, 0};
}

// Checks origins inside, outside, on faces and one step off them, with directions parallel to faces and not.
// The error is relative to the distance, or to the cube's side if that is larger.
void compare_spans(WorstError& error) {
  const auto origins = grid<float>({-1.5, -0x1p-24, 0, 0.25, 1, 1 + 0x1p-23, 2.5}),
             directions = grid<float>({-1, -0.3, 0, 1e-6, 0.7});
  for (Index i = 0; i < origins.shape[0]; ++i)
    for (Index k = 0; k < directions.shape[0]; ++k) {
      const float *o = &origins[3 * i], *d = &directions[3 * k];
      const CubeSpan got = intersect_unit_cube(o, d);
      const auto [near, far] = exact_span(o, d);
      // A span shorter than the rounding of its ends may come out empty, and an empty one may come out that
      // short.
      const Real round = 3e-7L * std::max<Real>({1, near, static_cast<Real>(got.far)});
      if ((near < far) != (got.near < got.far)) {
        const Real length = near < far ? far - near : static_cast<Real>(got.far) - got.near;
        error.equal(length < round, true);
        continue;
      }
      error.compare(got.near, near, std::max<Real>(1, near));
      error.compare(got.far, far, std::max<Real>(1, far));
    }
}

}  // namespace

std::vector<NumericsCase> numerics_cases() {
  std::vector<NumericsCase> all;
  add_ray_numerics(all);
  for (const double far : {0.0, 1e2, 1e4, 1e6, 1e9}) {
    char name[80];
    std::snprintf(name, sizeof name, "frequency_encoding: 2^15 x at %g", far);
    add_numerics(all, name, "1, sum of sizes", 3e-7, 4e-16,
                 [=](auto t, WorstError& e) { compare_frequency<decltype(t)>(far, e); });
  }
  add_numerics(all, "hash_encoding: on faces and edges of cells", "sum of sizes", 3e-7, 6e-16,
               [](auto t, WorstError& e) {
                 compare_hash(grid<decltype(t)>({0, 0.25, 0.484375, 0.5, 0.75, 1}), e);
               });
  add_numerics(all, "hash_encoding: outside of the cube", "sum of sizes", 4e-7, 1e-15,
               [](auto t, WorstError& e) {
                 compare_hash(grid<decltype(t)>({-3, -0.25, 0.4, 1.25, 7}), e);
               });
  add_numerics(all, "hash_encoding: NaN and infinite positions", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_hash_nan<decltype(t)>(e); });
  all.push_back(
      {"marching: rays parallel to faces, in them and from inside", "float", "distance, 1", 2e-7, [] {
         WorstError e;
         compare_spans(e);
         return e;
       }});
  return all;
}

}  // namespace fieldmark::nerf
