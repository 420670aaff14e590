#include "kernels/hash_grid.h"

#include <cstring>

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

constexpr int kBlock = 16;  // points whose corners are found together, so that loops over them vectorise

// The features of one entry: density in the lower half, colour in the upper half.
template <class T, int P>
struct EntryOf {
  typedef T type __attribute__((vector_size(2 * P * sizeof(T))));
};
template <class T, int P>
using Entry = typename EntryOf<T, P>::type;

template <class T, int P>
[[gnu::always_inline]] inline Entry<T, P> load(const T* p) {
  Entry<T, P> e;
  std::memcpy(&e, p, sizeof e);
  return e;
}

// bf16 is the upper half of a float.
template <class T, int P>
[[gnu::always_inline]] inline Entry<T, P> load(const std::uint16_t* p) {
  Entry<std::uint16_t, P> half;
  std::memcpy(&half, p, sizeof half);
  const Entry<std::uint32_t, P> bits = __builtin_convertvector(half, Entry<std::uint32_t, P>) << 16;
  Entry<T, P> e;
  std::memcpy(&e, &bits, sizeof e);
  return e;
}

// Joins two parts. Copying each into one array and reading that back as a whole would wait for both stores to
// reach the cache.
template <class T, int P>
[[gnu::always_inline]] inline Entry<T, P> joined(const T* density, const T* colour) {
  typedef T Part __attribute__((vector_size(P * sizeof(T))));
  Part d, c;
  std::memcpy(&d, density, sizeof d);
  std::memcpy(&c, colour, sizeof c);
  if constexpr (P == 2)
    return __builtin_shufflevector(d, c, 0, 1, 2, 3);
  else
    return __builtin_shufflevector(d, c, 0, 1, 2, 3, 4, 5, 6, 7);
}

// The eight cell corners around each of a block of points: index of the entry in its level and fraction along
// each axis.
template <class T, int P>
struct Corners {
  std::uint32_t place[8][kBlock];
  T f[3][kBlock];

  // Mueller et al. 2022, eq. 4: h = x XOR y * 2654435761 XOR z * 805459861, modulo a power of two.
  [[gnu::always_inline]] void find(const HashLevel& level, const T* x, int count) {
    std::uint32_t cell[3][kBlock];
    T position[3][kBlock] = {};
    for (int i = 0; i < count; ++i)
      for (int a = 0; a < 3; ++a) position[a][i] = x[3 * i + a];
    const T scale = static_cast<T>(level.resolution), top = scale - 1;
    for (int a = 0; a < 3; ++a)
      for (int i = 0; i < kBlock; ++i) {
        const T p = position[a][i] * scale;
        // Clamped before the cast, because converting a NaN or huge position to an integer is undefined.
        const T inside = p > 0 ? (p < top ? p : top) : T(0);
        const auto c = static_cast<std::int32_t>(inside);
        cell[a][i] = static_cast<std::uint32_t>(c);
        f[a][i] = p - static_cast<T>(c);
      }
    const std::uint32_t side = level.resolution + 1;
    const bool hashed = level.mask != 0;
    const std::uint32_t py = hashed ? 2654435761u : side, pz = hashed ? 805459861u : side * side;
    for (int i = 0; i < kBlock; ++i) {
      const std::uint32_t x0 = cell[0][i], y0 = cell[1][i] * py, z0 = cell[2][i] * pz;
      for (int k = 0; k < 8; ++k) {
        const std::uint32_t x1 = x0 + (k & 1), y1 = y0 + ((k >> 1) & 1) * py, z1 = z0 + ((k >> 2) & 1) * pz;
        place[k][i] = 2 * P * (hashed ? (x1 ^ y1 ^ z1) & level.mask : x1 + y1 + z1);
      }
    }
  }

  // Prefetches entries before their use: they are spread over megabytes, and a core waits longer for one of
  // them than it computes on a block.
  template <class S>
  [[gnu::always_inline]] void prefetch(const S* entries, int count) const {
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < 8; ++k) __builtin_prefetch(entries + place[k][i]);
  }

  [[gnu::always_inline]] void weights(T (*w)[kBlock]) const {
    for (int i = 0; i < kBlock; ++i) {
      const T x1 = f[0][i], y1 = f[1][i], z1 = f[2][i], x0 = 1 - x1, y0 = 1 - y1, z0 = 1 - z1;
      const T a = y0 * z0, b = y1 * z0, c = y0 * z1, d = y1 * z1;
      w[0][i] = x0 * a, w[1][i] = x1 * a, w[2][i] = x0 * b, w[3][i] = x1 * b;
      w[4][i] = x0 * c, w[5][i] = x1 * c, w[6][i] = x0 * d, w[7][i] = x1 * d;
    }
  }
};

// Calls use(level, corners, first point, count) for blocks of points in order, level by level; each block's
// entries are prefetched one block ahead, also across levels.
template <class T, int P, class S, class F>
[[gnu::always_inline]] inline void for_blocks(const HashLevel* level, int levels, const T* x, std::int64_t n,
                                              const S* table, F use) {
  if (n <= 0) return;
  Corners<T, P> corners[2];
  const auto count = [n](std::int64_t begin) {
    return static_cast<int>(n - begin < kBlock ? n - begin : kBlock);
  };
  const auto ask = [&](int l, std::int64_t begin, Corners<T, P>& to) {
    to.find(level[l], x + 3 * begin, count(begin));
    if (level[l].mask) to.prefetch(table + level[l].first * 2 * P, count(begin));
  };
  int now = 0;
  ask(0, 0, corners[now]);
  for (int l = 0; l < levels; ++l)
    for (std::int64_t begin = 0; begin < n; begin += kBlock, now ^= 1) {
      if (begin + kBlock < n)
        ask(l, begin + kBlock, corners[now ^ 1]);
      else if (l + 1 < levels)
        ask(l + 1, 0, corners[now ^ 1]);
      use(l, corners[now], begin, count(begin));
    }
}

template <class T, int P, class S>
void forward(const HashLevel* level, int levels, const T* x, std::int64_t n, const S* table, T* density,
             T* colour) {
  const std::int64_t width = P * levels;
  for_blocks<T, P>(level, levels, x, n, table,
                   [&](int l, const Corners<T, P>& corners, std::int64_t begin, int count) {
                     const S* entries = table + level[l].first * 2 * P;
                     alignas(64) T w[8][kBlock];
                     corners.weights(w);
                     for (int i = 0; i < count; ++i) {
                       Entry<T, P> sum{};
                       for (int k = 0; k < 8; ++k) sum += w[k][i] * load<T, P>(entries + corners.place[k][i]);
                       T parts[2 * P];
                       std::memcpy(parts, &sum, sizeof sum);
                       std::memcpy(density + (begin + i) * width + P * l, parts, P * sizeof(T));
                       std::memcpy(colour + (begin + i) * width + P * l, parts + P, P * sizeof(T));
                     }
                   });
}

// Loads dL/d(entry) at one point and level; either part may be absent.
template <class T, int P>
[[gnu::always_inline]] inline Entry<T, P> cotangent(const T* ddensity, const T* dcolour, std::int64_t at) {
  const T none[P] = {};
  return joined<T, P>(ddensity ? ddensity + at : none, dcolour ? dcolour + at : none);
}

template <class T, int P>
void by_level(int levels, const T* ddensity, const T* dcolour, std::int64_t begin, std::int64_t end,
              std::int64_t n, T* out) {
  for (std::int64_t b = begin; b < end; b += kBlock)  // so that whole cache lines are written at a time
    for (int l = 0; l < levels; ++l)
      for (std::int64_t i = b; i < end && i < b + kBlock; ++i) {
        const Entry<T, P> g = cotangent<T, P>(ddensity, dcolour, (i * levels + l) * P);
        std::memcpy(out + (l * n + i) * 2 * P, &g, sizeof g);
      }
}

template <class T, int P>
void backward_level(const HashLevel& level, const T* x, std::int64_t n, const T* d, T* grad) {
  T* entries = grad + level.first * 2 * P;
  for_blocks<T, P>(&level, 1, x, n, grad,
                   [&](int, const Corners<T, P>& corners, std::int64_t begin, int count) {
                     alignas(64) T w[8][kBlock];
                     corners.weights(w);
                     for (int i = 0; i < count; ++i) {
                       const Entry<T, P> g = load<T, P>(d + (begin + i) * 2 * P);
                       for (int k = 0; k < 8; ++k) {
                         T* at = entries + corners.place[k][i];
                         const Entry<T, P> sum = load<T, P>(at) + w[k][i] * g;
                         std::memcpy(at, &sum, sizeof sum);
                       }
                     }
                   });
}

// With y = sum_k w_k(f) e_k and f = x * resolution - cell, dy/dx_a = resolution * sum_k dw_k/df_a e_k.
template <class T, int P>
void backward_x(const HashLevel* level, int levels, const T* x, std::int64_t n, const T* table,
                const T* ddensity, const T* dcolour, T* dx) {
  Corners<T, P> corners;
  for (int l = 0; l < levels; ++l) {
    const T* entries = table + level[l].first * 2 * P;
    const T scale = static_cast<T>(level[l].resolution);
    for (std::int64_t begin = 0; begin < n; begin += kBlock) {
      const int count = static_cast<int>(n - begin < kBlock ? n - begin : kBlock);
      corners.find(level[l], x + 3 * begin, count);
      for (int i = 0; i < count; ++i) {
        const Entry<T, P> g = cotangent<T, P>(ddensity, dcolour, ((begin + i) * levels + l) * P);
        for (int k = 0; k < 8; ++k) {
          const Entry<T, P> e = g * load<T, P>(entries + corners.place[k][i]);
          T dot = 0, weight[3], sign[3];
          for (int j = 0; j < 2 * P; ++j) dot += e[j];
          for (int a = 0; a < 3; ++a) {
            const bool up = (k >> a) & 1;
            weight[a] = up ? corners.f[a][i] : 1 - corners.f[a][i];
            sign[a] = up ? T(1) : T(-1);
          }
          for (int a = 0; a < 3; ++a)
            dx[3 * (begin + i) + a] += scale * dot * sign[a] * weight[(a + 1) % 3] * weight[(a + 2) % 3];
        }
      }
    }
  }
}

}  // namespace

template <class T>
void hash_forward(const HashLevel* level, int levels, int part, const T* x, std::int64_t n, const T* table,
                  T* density, T* colour) {
  (part == 2 ? forward<T, 2, T> : forward<T, 4, T>)(level, levels, x, n, table, density, colour);
}

void hash_forward_bf16(const HashLevel* level, int levels, int part, const float* x, std::int64_t n,
                       const std::uint16_t* table, float* density, float* colour) {
  (part == 2 ? forward<float, 2, std::uint16_t> : forward<float, 4, std::uint16_t>)(level, levels, x, n,
                                                                                    table, density, colour);
}

template <class T>
void hash_by_level(int levels, int part, const T* ddensity, const T* dcolour, std::int64_t begin,
                   std::int64_t end, std::int64_t n, T* out) {
  (part == 2 ? by_level<T, 2> : by_level<T, 4>)(levels, ddensity, dcolour, begin, end, n, out);
}

template <class T>
void hash_backward_level(const HashLevel& level, int part, const T* x, std::int64_t n, const T* d, T* grad) {
  (part == 2 ? backward_level<T, 2> : backward_level<T, 4>)(level, x, n, d, grad);
}

template <class T>
void hash_backward_x(const HashLevel* level, int levels, int part, const T* x, std::int64_t n, const T* table,
                     const T* ddensity, const T* dcolour, T* dx) {
  (part == 2 ? backward_x<T, 2> : backward_x<T, 4>)(level, levels, x, n, table, ddensity, dcolour, dx);
}

#define FIELDMARK_INSTANTIATE(T)                                                                           \
  template void hash_forward(const HashLevel*, int, int, const T*, std::int64_t, const T*, T*, T*);        \
  template void hash_by_level(int, int, const T*, const T*, std::int64_t, std::int64_t, std::int64_t, T*); \
  template void hash_backward_level(const HashLevel&, int, const T*, std::int64_t, const T*, T*);          \
  template void hash_backward_x(const HashLevel*, int, int, const T*, std::int64_t, const T*, const T*,    \
                                const T*, T*);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
