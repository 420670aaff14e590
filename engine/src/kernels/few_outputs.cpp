#include "kernels/few_outputs.h"

#include <fieldmark/engine/simd.h>

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

using simd::kLanes;
using simd::Vec;

// An estimate from multiply-adds: with more outputs than a quarter of the lanes, the planes cost more than
// the lanes that gemm() leaves empty.
template <class T>
constexpr int kMost = kLanes<T> / 4;

// Vectors of pixels of a block: 4 to 8 sums hide the latency of a multiply-add.
constexpr int vectors_of(int outputs) { return outputs < 3 ? 4 : 2; }

// Computes `count` pixels from `first` on, at most B vectors, for all O outputs.
template <class T, int O, int B>
[[gnu::always_inline]] inline void block(const FewOutputs<T>& f, Index first, Index count) {
  constexpr int L = kLanes<T>;
  T* y = f.y + first * O;
  T lanes[O][B * L] = {};
  if (f.accumulate)
    for (Index j = 0; j < count; ++j)
      for (int o = 0; o < O; ++o) lanes[o][j] = y[j * O + o];
  Vec<T> sum[O][B];
  for (int o = 0; o < O; ++o)
    for (int b = 0; b < B; ++b)
      sum[o][b] = f.bias ? simd::broadcast(f.bias[o]) : simd::load(lanes[o] + b * L);
  const T* w = f.w;
  for (Index u = 0; u < f.window; ++u)
    for (Index v = 0; v < f.window; ++v) {
      const T* x = f.x + u * f.row + v + first;
      for (Index c = 0; c < f.channels; ++c, x += f.plane, w += O)
        for (int b = 0; b < B; ++b) {
          const Vec<T> seen = simd::load(x + b * L);
          for (int o = 0; o < O; ++o) sum[o][b] += w[o] * seen;
        }
    }
  for (int o = 0; o < O; ++o)
    for (int b = 0; b < B; ++b)  // Zero comes first: NaN stays NaN.
      simd::store(lanes[o] + b * L, f.relu ? simd::max(Vec<T>{}, sum[o][b]) : sum[o][b]);
  for (Index j = 0; j < count; ++j)
    for (int o = 0; o < O; ++o) y[j * O + o] = lanes[o][j];
}

template <class T, int O>
void row_of(const FewOutputs<T>& f) {
  constexpr int B = vectors_of(O);
  constexpr Index L = kLanes<T>, whole = B * L;
  Index j = 0;
  for (; j + whole <= f.pixels; j += whole) block<T, O, B>(f, j, whole);
  for (; j < f.pixels; j += L) block<T, O, 1>(f, j, f.pixels - j < L ? f.pixels - j : L);
}

template <class T>
[[gnu::always_inline]] inline T seen(const T* x, const T* mask, Index at) {
  return !mask || mask[at] > 0 ? x[at] : T(0);
}

typedef float Four __attribute__((vector_size(16)));

// Transposes 4 pixels of 4 channels.
[[gnu::always_inline]] inline void transpose_four(const float* x, const float* mask, Index channels,
                                                  Index plane, float* out) {
  Four pixel[4];
  for (int j = 0; j < 4; ++j) {
    std::memcpy(&pixel[j], x + j * channels, sizeof(Four));
    if (!mask) continue;
    Four open;
    std::memcpy(&open, mask + j * channels, sizeof(Four));
    pixel[j] = open > Four{} ? pixel[j] : Four{};
  }
  const Four low01 = __builtin_shufflevector(pixel[0], pixel[1], 0, 4, 1, 5),
             low23 = __builtin_shufflevector(pixel[2], pixel[3], 0, 4, 1, 5),
             high01 = __builtin_shufflevector(pixel[0], pixel[1], 2, 6, 3, 7),
             high23 = __builtin_shufflevector(pixel[2], pixel[3], 2, 6, 3, 7);
  const Four channel[4] = {__builtin_shufflevector(low01, low23, 0, 1, 4, 5),
                           __builtin_shufflevector(low01, low23, 2, 3, 6, 7),
                           __builtin_shufflevector(high01, high23, 0, 1, 4, 5),
                           __builtin_shufflevector(high01, high23, 2, 3, 6, 7)};
  for (int c = 0; c < 4; ++c) std::memcpy(out + c * plane, &channel[c], sizeof(Four));
}

}  // namespace

template <class T>
void pixel_planes(const T* x, const T* mask, Index pixels, Index channels, Index plane, T* out) {
  const auto one = [=](Index j, Index c) { out[c * plane + j] = seen(x, mask, j * channels + c); };
  Index j = 0;
  if constexpr (sizeof(T) == sizeof(float))
    for (; j + 4 <= pixels; j += 4) {
      Index c = 0;
      for (; c + 4 <= channels; c += 4) {
        const Index at = j * channels + c;
        transpose_four(x + at, mask ? mask + at : nullptr, channels, plane, out + c * plane + j);
      }
      for (; c < channels; ++c)
        for (Index k = j; k < j + 4; ++k) one(k, c);
    }
  for (; j < pixels; ++j)
    for (Index c = 0; c < channels; ++c) one(j, c);
}

template <class T>
Index most_few_outputs() {
  return kMost<T>;
}

template <class T>
void few_outputs(const FewOutputs<T>& f) {
  switch (f.outputs) {
    case 1:
      return row_of<T, 1>(f);
    case 2:
      return row_of<T, (kMost<T> < 2 ? 1 : 2)>(f);
    case 3:
      return row_of<T, (kMost<T> < 3 ? 1 : 3)>(f);
    case 4:
      return row_of<T, (kMost<T> < 4 ? 1 : 4)>(f);
    default:
      return;
  }
}

#define FIELDMARK_INSTANTIATE(T)                                           \
  template void pixel_planes(const T*, const T*, Index, Index, Index, T*); \
  template Index most_few_outputs<T>();                                    \
  template void few_outputs(const FewOutputs<T>&);
FIELDMARK_INSTANTIATE(float)
FIELDMARK_INSTANTIATE(double)
#undef FIELDMARK_INSTANTIATE

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
