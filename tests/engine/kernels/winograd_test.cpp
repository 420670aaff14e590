#include "kernels/winograd.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

namespace fieldmark::kernels {
namespace {

constexpr Index kTile = kWinogradTile, kProducts = kWinogradProducts;
constexpr float kUntouched = 7;

struct Size {
  Index n, h, w, c;
  Index across() const { return (w + kTile - 1) / kTile; }
  Index down() const { return (h + kTile - 1) / kTile; }
  Index tiles() const { return n * across() * down(); }
  // Returns x at (i, j) of a tile, counted from its first pixel; 0 outside.
  double at(const Tensor<float>& x, const Tensor<float>* mask, Index tile, Index i, Index j, Index k) const {
    const Index y = tile / across() % down() * kTile + i, z = tile % across() * kTile + j;
    if (y < 0 || y >= h || z < 0 || z >= w) return 0;
    const Index place = ((tile / across() / down() * h + y) * w + z) * c + k;
    return mask && !((*mask)[place] > 0) ? 0 : x[place];
  }
};

// The points of evaluation, and each matrix from its definition, in double.
constexpr int kFinite = 5;
const double kPoint[kFinite] = {0, std::sqrt(0.5), -std::sqrt(0.5), std::sqrt(2.0), -std::sqrt(2.0)};
using Matrix = std::vector<std::vector<double>>;

Matrix powers(int columns) {
  Matrix m(6, std::vector<double>(static_cast<std::size_t>(columns), 0.0));
  for (int i = 0; i < kFinite; ++i)
    for (int j = 0; j < columns; ++j) m[i][j] = std::pow(kPoint[i], j);
  m[5].back() = 1;
  return m;
}
Matrix weights_matrix() {
  Matrix m = powers(3);
  for (int i = 0; i < kFinite; ++i)
    for (double& v : m[i])
      for (int j = 0; j < kFinite; ++j)
        if (j != i) v /= kPoint[i] - kPoint[j];
  return m;
}
Matrix window_matrix() {
  Matrix m(6, std::vector<double>(6, 0.0));
  for (int i = 0; i < 6; ++i) {
    std::vector<double> p(6, 0.0);
    p[0] = 1;
    for (int j = 0; j < kFinite; ++j)
      if (j != i)
        for (int k = 5; k >= 0; --k) p[k] = (k > 0 ? p[k - 1] : 0) - kPoint[j] * p[k];
    m[i] = p;
  }
  return m;
}
Matrix transposed(const Matrix& m) {
  Matrix t(m[0].size(), std::vector<double>(m.size()));
  for (std::size_t i = 0; i < m.size(); ++i)
    for (std::size_t j = 0; j < m[0].size(); ++j) t[j][i] = m[i][j];
  return t;
}

// Returns (L X L^T)[i, j], with X given by a function.
template <class F>
double both_axes(const Matrix& l, int i, int j, F x) {
  double sum = 0;
  for (int a = 0; a < static_cast<int>(l[0].size()); ++a)
    for (int b = 0; b < static_cast<int>(l[0].size()); ++b) sum += l[i][a] * l[j][b] * x(a, b);
  return sum;
}

Index round_up(Index n, Index to) { return (n + to - 1) / to * to; }

// Matrices [rows, columns] in panels, followed by memory that must stay unchanged.
struct Room {
  Room(Index rows, Index columns, Index panel_)
      : panel(panel_),
        distance(rows * panel_),
        stride(rows * round_up(columns, panel_) + 5),
        data(static_cast<std::size_t>(kProducts * stride), kUntouched) {}
  WinogradMatrices<float> matrices() { return {data.data(), stride, panel, distance}; }
  WinogradMatrices<const float> matrices() const { return {data.data(), stride, panel, distance}; }
  float& at(Index k, Index row, Index column) {
    return data[static_cast<std::size_t>(k * stride + column / panel * distance + row * panel +
                                         column % panel)];
  }
  bool rest_untouched() const {
    for (Index k = 0; k < kProducts; ++k)
      for (Index i = 1; i <= 5; ++i)
        if (data[static_cast<std::size_t>((k + 1) * stride - i)] != kUntouched) return false;
    return true;
  }
  Index panel, distance, stride;
  std::vector<float> data;
};

// Checks windows or tiles of all but the first tile against the definition; columns beyond the channels are
// zeros.
template <class Kernel>
double worst_of_transform(Kernel run, const Matrix& line, Index border, const Size& s, Index panel,
                          bool masked) {
  const auto x = uniform<float>({s.n, s.h, s.w, s.c}, -1, 1, 1), m = uniform<float>(x.shape, -1, 1, 2);
  const Index first = s.tiles() > 1 ? 1 : 0, count = s.tiles() - first;
  Room room(count, s.c, panel);
  run({x.data.data(), masked ? m.data.data() : nullptr, s.h, s.w, s.c, first, count}, room.matrices());
  double worst = room.rest_untouched() ? 0 : 1e9;
  for (Index t = 0; t < count; ++t)
    for (Index k = 0; k < kProducts; ++k)
      for (Index c = 0; c < round_up(s.c, panel); ++c) {
        const double want =
            c >= s.c ? 0
                     : both_axes(line, static_cast<int>(k / 6), static_cast<int>(k % 6), [&](int i, int j) {
                         return s.at(x, masked ? &m : nullptr, first + t, i - border, j - border, c);
                       });
        raise_to(worst, std::abs(want - room.at(k, t, c)));
      }
  return worst;
}

std::vector<Size> sizes() {
  std::vector<Size> all;
  for (Index side : {1, 2, 3, 4, 5, 7, 8, 9, 13}) all.push_back({2, side, 14 - side, 5});
  for (Index c = 1; c <= 130; c += c < 20 ? 1 : 11) all.push_back({1, 9, 6, c});
  return all;
}

}  // namespace

TEST_CASE("kernels/winograd: windows and tiles are what the definitions of their matrices say") {
  each_isa([] {
    for (const Size& s : sizes())
      for (bool masked : {false, true}) {
        CAPTURE(s.n, s.h, s.w, s.c, masked);
        // Entries reach 50; measured 1.1e-5 and 2.9e-6.
        CHECK(worst_of_transform(FIELDMARK_KERNEL(winograd_windows<float>), window_matrix(), 1, s, s.c,
                                 masked) < 2e-5);
        CHECK(worst_of_transform(FIELDMARK_KERNEL(winograd_tiles<float>), powers(4), 0, s, Index{16},
                                 masked) < 6e-6);
      }
  });
}

TEST_CASE("kernels/winograd: weights and their gradient are what the definition of G says") {
  each_isa([] {
    const Matrix g = weights_matrix(), back = transposed(g);
    for (Index c_out : {1, 3, 16, 17, 40, 130}) {
      const Index c_in = 6, first = 2, count = 3;
      CAPTURE(c_out);
      const auto w = uniform<float>({3, 3, c_in, c_out}, -1, 1, 1);
      Room room(c_in, c_out, 32);
      FIELDMARK_KERNEL(winograd_weights<float>)
      (w.data.data(), c_in, c_out, first, count, room.matrices());
      double worst = room.rest_untouched() ? 0 : 1e9;
      for (Index k = 0; k < kProducts; ++k)
        for (Index c = 0; c < c_in; ++c)
          for (Index o = 0; o < round_up(c_out, 32); ++o) {
            const double want =
                c < first || c >= first + count ? kUntouched
                : o >= c_out
                    ? 0
                    : both_axes(g, static_cast<int>(k / 6), static_cast<int>(k % 6),
                                [&](int i, int j) { return w[((i * 3 + j) * c_in + c) * c_out + o]; });
            raise_to(worst, std::abs(want - room.at(k, c, o)));
          }
      CHECK(worst < 1e-6);

      Room m(c_in, c_out, c_out + 3);  // one panel, wider than the matrix
      const auto values = uniform<float>({kProducts, c_in, c_out}, -1, 1, 2);
      for (Index i = 0; i < values.size(); ++i)
        m.at(i / (c_in * c_out), i / c_out % c_in, i % c_out) = values[i];
      Tensor<float> dw = w;
      FIELDMARK_KERNEL(winograd_weight_gradient<float>)
      (std::as_const(m).matrices(), c_in, c_out, dw.data.data());
      worst = 0;
      for (Index at = 0; at < c_in * c_out; ++at)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) {
            const Index place = (i * 3 + j) * c_in * c_out + at;
            const double want = w[place] + both_axes(back, i, j, [&](int a, int b) {
                                  return values[(a * 6 + b) * c_in * c_out + at];
                                });
            raise_to(worst, std::abs(want - dw[place]));
          }
      CHECK(worst < 2e-6);
    }
  });
}

TEST_CASE("kernels/winograd: outputs stay inside the image, with bias, ReLU or what was there") {
  each_isa([] {
    const Matrix line = transposed(powers(4));
    for (const Size& s : sizes())
      for (int way = 0; way < 3; ++way) {
        CAPTURE(s.n, s.h, s.w, s.c, way);
        const bool accumulate = way == 1, relu = way == 2;
        const auto before = uniform<float>({s.n, s.h, s.w, s.c}, -1, 1, 1),
                   bias = uniform<float>({s.c}, -1, 1, 2),
                   values = uniform<float>({kProducts, s.tiles(), s.c}, -1, 1, 3);
        Room m(s.tiles(), s.c, s.c + 3);  // one panel, wider than the matrix
        for (Index i = 0; i < values.size(); ++i)
          m.at(i / (s.tiles() * s.c), i / s.c % s.tiles(), i % s.c) = values[i];
        Tensor<float> y = before;
        y.data.push_back(kUntouched);
        FIELDMARK_KERNEL(winograd_outputs<float>)
        ({nullptr, nullptr, s.h, s.w, s.c, 0, s.tiles()}, std::as_const(m).matrices(),
         {y.data.data(), accumulate ? nullptr : bias.data.data(), accumulate, relu});
        double worst = 0;
        for (Index p = 0; p < s.n * s.h * s.w; ++p)
          for (Index c = 0; c < s.c; ++c) {
            const Index i = p / s.w % s.h, j = p % s.w;
            const Index tile = (p / s.w / s.h * s.down() + i / kTile) * s.across() + j / kTile;
            double want =
                both_axes(line, static_cast<int>(i % kTile), static_cast<int>(j % kTile),
                          [&](int a, int b) { return values[((a * 6 + b) * s.tiles() + tile) * s.c + c]; });
            want += accumulate ? before[p * s.c + c] : bias[c];
            if (relu) want = std::max(want, 0.0);
            raise_to(worst, std::abs(want - y[p * s.c + c]));
          }
        CHECK(worst < 1e-5);
        CHECK(y.data.back() == kUntouched);
      }
  });
}

}  // namespace fieldmark::kernels
