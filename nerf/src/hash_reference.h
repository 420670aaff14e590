#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

/// One cell corner of a position at a level, by the formulas of Mueller et al. 2022 (eq. 4) in 64-bit
/// integers and long double.
struct HashCorner {
  std::int64_t row;                     ///< within the level
  long double weight;                   ///< trilinear
  std::array<long double, 3> gradient;  ///< of the weight with respect to the position
};

/// @param n     cells per axis   @param table  size of a hashed level, 0 for a level indexed directly
inline std::array<HashCorner, 8> hash_corners(std::int64_t n, std::int64_t table,
                                              const std::array<double, 3>& x) {
  std::array<std::int64_t, 3> cell;
  std::array<long double, 3> f;
  for (std::size_t a = 0; a < 3; ++a) {
    const long double p = static_cast<long double>(x[a]) * static_cast<long double>(n);
    cell[a] = std::min(std::max(static_cast<std::int64_t>(std::floor(p)), std::int64_t{0}), n - 1);
    f[a] = p - static_cast<long double>(cell[a]);
  }
  std::array<HashCorner, 8> corners;
  for (std::size_t k = 0; k < 8; ++k) {
    std::array<std::int64_t, 3> c;
    std::array<long double, 3> w, dw;
    for (std::size_t a = 0; a < 3; ++a) {
      const bool up = ((k >> a) & 1) != 0;
      c[a] = cell[a] + (up ? 1 : 0);
      w[a] = up ? f[a] : 1 - f[a];
      dw[a] = static_cast<long double>(up ? n : -n);
    }
    corners[k].row = table > 0 ? (c[0] ^ (c[1] * 2654435761LL) ^ (c[2] * 805459861LL)) % table
                               : c[0] + (n + 1) * (c[1] + (n + 1) * c[2]);
    corners[k].weight = w[0] * w[1] * w[2];
    corners[k].gradient = {dw[0] * w[1] * w[2], w[0] * dw[1] * w[2], w[0] * w[1] * dw[2]};
  }
  return corners;
}
