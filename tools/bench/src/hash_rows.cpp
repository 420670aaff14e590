#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/hash_encoding.h>

#include <algorithm>
#include <cmath>

#include "rows.h"

namespace fieldmark::bench {
namespace {

using nerf::HashEncoding;
constexpr Index kPoints = 1 << 18;
constexpr int kFeatures = 2, kEntry = 2 * kFeatures;
constexpr nerf::HashEncodingOptions kOptions{
    .levels = 16, .features = kFeatures, .log2_table = 17, .base_resolution = 16, .finest_resolution = 512};

// Sample points on rays through the cube, in tiles of 16 x 16 pixels of a 64 x 64 image: 64 samples each,
// spaced by 1 / 512 of the diagonal and starting on the surface of a sphere.
std::vector<float> along_rays(Index points) {
  std::vector<float> x;
  for (Index p = 0; p < points; ++p) {
    const Index ray = p / 64, tile = ray / 256, in_tile = ray % 256;
    const Index column = tile % 4 * 16 + in_tile % 16, row = tile / 4 % 4 * 16 + in_tile / 16;
    const double u = static_cast<double>(column) / 64 - 0.5, v = static_cast<double>(row) / 64 - 0.5;
    const double near = 0.5 - 0.4 * std::sqrt(std::max(0.0, 1 - 2 * (u * u + v * v)));
    const double t = near + static_cast<double>(p % 64) * std::sqrt(3.0) / 512;
    x.push_back(static_cast<float>(0.5 + 0.8 * u + 0.1 * t));
    x.push_back(static_cast<float>(0.5 + 0.8 * v - 0.05 * t));
    x.push_back(static_cast<float>(std::min(t, 1.0)));
  }
  return x;
}

std::vector<float> at_random(Index points) {
  std::vector<float> x = numbers<float>(3 * points, 5);
  for (float& v : x) v = (v + 1) / 2;
  return x;
}

// The scalar baseline of the kernels: one point, one level, one corner, one feature at a time.
struct Scalar {
  explicit Scalar(const HashEncoding<float>& hash) : encoding(hash) {
    std::int64_t rows = 0;
    const std::int64_t cap = std::int64_t{1} << kOptions.log2_table;
    for (int l = 0; l < encoding.levels(); ++l) {
      const std::int64_t n = encoding.resolution(l) + 1;
      hashed.push_back(n * n * n > cap);
      first.push_back(rows);
      rows += hashed.back() ? cap : n * n * n;
    }
  }
  // Calls use(row, weight) for the corners of the cell around x.
  template <class T, class F>
  void corners(int level, const T* x, F use) const {
    const auto n = static_cast<std::uint32_t>(encoding.resolution(level));
    std::uint32_t cell[3];
    T f[3];
    for (int a = 0; a < 3; ++a) {
      const T p = x[a] * static_cast<T>(n);
      cell[a] = std::min(static_cast<std::uint32_t>(p), n - 1);
      f[a] = p - static_cast<T>(cell[a]);
    }
    for (std::uint32_t k = 0; k < 8; ++k) {
      std::uint32_t c[3];
      T w = 1;
      for (std::uint32_t a = 0; a < 3; ++a) {
        c[a] = cell[a] + (k >> a & 1);
        w *= (k >> a & 1) ? f[a] : 1 - f[a];
      }
      const auto l = static_cast<std::size_t>(level);
      const std::uint32_t row =
          hashed[l] ? (c[0] ^ c[1] * 2654435761u ^ c[2] * 805459861u) & ((1u << kOptions.log2_table) - 1)
                    : c[0] + (n + 1) * (c[1] + (n + 1) * c[2]);
      use(first[l] + row, w);
    }
  }
  template <class T>
  void forward(const T* table, const T* x, Index n, T* density, T* colour) const {
    const Index width = encoding.width();
    for (Index i = 0; i < n; ++i)
      for (int l = 0; l < encoding.levels(); ++l) {
        T sum[kEntry] = {};
        corners(l, x + 3 * i, [&](std::int64_t row, T w) {
          for (int j = 0; j < kEntry; ++j) sum[j] += w * table[row * kEntry + j];
        });
        for (int j = 0; j < kFeatures; ++j) {
          density[i * width + kFeatures * l + j] = sum[j];
          colour[i * width + kFeatures * l + j] = sum[kFeatures + j];
        }
      }
  }
  template <class T>
  void backward(int first_level, int every, const T* x, Index n, const T* ddensity, const T* dcolour,
                T* grad) const {
    const Index width = encoding.width();
    for (Index i = 0; i < n; ++i)
      for (int l = first_level; l < encoding.levels(); l += every)
        corners(l, x + 3 * i, [&](std::int64_t row, T w) {
          for (int j = 0; j < kFeatures; ++j) {
            grad[row * kEntry + j] += w * ddensity[i * width + kFeatures * l + j];
            grad[row * kEntry + kFeatures + j] += w * dcolour[i * width + kFeatures * l + j];
          }
        });
  }
  const HashEncoding<float>& encoding;
  std::vector<bool> hashed;
  std::vector<std::int64_t> first;
};

struct Hash {
  Hash(std::vector<float> points) : x(std::move(points)), n(static_cast<Index>(x.size()) / 3) {
    const std::vector<float> start = numbers<float>(store.size(), 6);
    std::copy(start.begin(), start.end(), store.values().begin());
    density.resize(static_cast<std::size_t>(n * encoding.width()));
    colour.resize(density.size());
    scratch.resize(2 * density.size());
    for (auto* g : {&ddensity, &dcolour}) *g = numbers<float>(n * encoding.width(), 7);
  }
  void forward() { encoding.encode(store.values(), x.data(), n, density.data(), colour.data()); }
  void forward_scalar() {
    parallel_for(n, 1024, [&](Index b, Index e) {
      scalar.forward(store.values().data(), x.data() + 3 * b, e - b, density.data() + b * encoding.width(),
                     colour.data() + b * encoding.width());
    });
  }
  void backward() {
    encoding.backward(x.data(), n, ddensity.data(), dcolour.data(), store.grads(), scratch.data());
  }
  // Threads own levels, because no two may add to the same row.
  void backward_scalar() {
    const int parts = threads();
    parallel_for(parts, 1, [&](Index part, Index) {
      scalar.backward(static_cast<int>(part), parts, x.data(), n, ddensity.data(), dcolour.data(),
                      store.grads().data());
    });
  }

  std::vector<float> x, density, colour, ddensity, dcolour, scratch;
  Index n;
  ParamStore<float> store;
  HashEncoding<float> encoding{store, "hash", kOptions, 1};
  Scalar scalar{encoding};
};

// Compares both with the scalar loop in double, on a part of the points.
double error_of(Hash& h, bool forward) {
  const Index n = std::min<Index>(h.n, 4096), width = h.encoding.width();
  const auto size = static_cast<std::size_t>(n * width);
  const std::vector<double> x(h.x.begin(), h.x.begin() + 3 * n),
      table(h.store.values().begin(), h.store.values().end()),
      dd(h.ddensity.begin(), h.ddensity.begin() + n * width),
      dc(h.dcolour.begin(), h.dcolour.begin() + n * width);
  if (forward) {
    std::vector<double> density(size), colour(size);
    h.scalar.forward(table.data(), x.data(), n, density.data(), colour.data());
    h.forward();
    return std::max(relative_error(h.density, density), relative_error(h.colour, colour));
  }
  std::vector<double> grad(table.size());
  std::fill(h.store.grads().begin(), h.store.grads().end(), 0.f);
  h.scalar.backward(0, 1, x.data(), n, dd.data(), dc.data(), grad.data());
  h.encoding.backward(h.x.data(), n, h.ddensity.data(), h.dcolour.data(), h.store.grads(), h.scratch.data());
  return relative_error(h.store.grads(), grad);
}

EngineRow measured(bool rays, bool forward, const EngineBenchOptions& o) {
  const Index points = std::max<Index>(4096, static_cast<Index>(static_cast<double>(kPoints) * o.scale));
  Hash h(rays ? along_rays(points) : at_random(points));
  const Timing plain = time_calls([&] { forward ? h.forward_scalar() : h.backward_scalar(); }, o.runs);
  const Timing ours = time_calls([&] { forward ? h.forward() : h.backward(); }, o.runs);
  EngineRow row = row_of(ours, 0, static_cast<double>(points));
  row.speedup = plain.seconds / ours.seconds;
  row.error = error_of(h, forward);
  return row;
}

}  // namespace

std::vector<RowSpec> hash_rows() {
  const auto row = [](const char* name, const char* what, bool rays, bool forward) {
    return RowSpec{name, what, [=](const EngineBenchOptions& o) { return measured(rays, forward, o); }};
  };
  return {row("hash_2e17_forward", "16 levels, 2^17 entries, along rays in image tiles", true, true),
          row("hash_2e17_backward", "the same backward", true, false),
          row("hash_2e17_forward_random", "16 levels, 2^17 entries, points at random", false, true),
          row("hash_2e17_backward_random", "the same backward", false, false)};
}

}  // namespace fieldmark::bench
