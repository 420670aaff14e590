#include "simulated_jpeg.h"
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace fieldmark::baselines {
namespace {

constexpr Index kJpegBlock = 8;
// ITU-R BT.601 as in JPEG files; rows Y, Cb, Cr.
constexpr double kToYcc[9] = {0.299, 0.587, 0.114,        -0.168735892, -0.331264108,
                              0.5,   0.5,   -0.418687589, -0.081312411};

using Matrix3 = std::array<double, 9>;

Matrix3 inverse(const double* a) {
  const auto minor = [&](int r0, int r1, int c0, int c1) {
    return a[3 * r0 + c0] * a[3 * r1 + c1] - a[3 * r0 + c1] * a[3 * r1 + c0];
  };
  const double det = a[0] * minor(1, 2, 1, 2) - a[1] * minor(1, 2, 0, 2) + a[2] * minor(1, 2, 0, 1);
  return {minor(1, 2, 1, 2) / det,  -minor(0, 2, 1, 2) / det, minor(0, 1, 1, 2) / det,
          -minor(1, 2, 0, 2) / det, minor(0, 2, 0, 2) / det,  -minor(0, 1, 0, 2) / det,
          minor(1, 2, 0, 1) / det,  -minor(0, 2, 0, 1) / det, minor(0, 1, 0, 1) / det};
}

Matrix3 transposed(const Matrix3& m) { return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}; }

// P = D_k^T D_k, the projection of 8 numbers onto their k lowest frequencies: filtering the rows and columns
// of a block with P equals masking its coefficients.
using Projection = std::array<double, 64>;
Projection projection(Index kept) {
  Projection p{};
  for (Index u = 0; u < kept; ++u)
    for (Index i = 0; i < kJpegBlock; ++i)
      for (Index j = 0; j < kJpegBlock; ++j) {
        const auto cosine = [&](Index x) {
          return std::cos((2 * static_cast<double>(x) + 1) * static_cast<double>(u) * std::numbers::pi / 16);
        };
        p[static_cast<std::size_t>(i * kJpegBlock + j)] += (u == 0 ? 0.125 : 0.25) * cosine(i) * cosine(j);
      }
  return p;
}

struct JpegPlan {
  Matrix3 in, out;  // before and after the transform
  Projection luma, chroma;
};

// y = or += out (P (in x) P) over one block; x and y point to its first pixel, `row` numbers per row.
template <class T>
void filter_block(const JpegPlan& plan, const T* x, T* y, Index row, bool add) {
  double plane[3][64], half[64];
  for (Index i = 0; i < kJpegBlock; ++i)
    for (Index j = 0; j < kJpegBlock; ++j)
      for (Index c = 0; c < 3; ++c) {
        const T* v = x + i * row + 3 * j;
        const double* m = plan.in.data() + 3 * c;
        plane[c][i * kJpegBlock + j] = m[0] * static_cast<double>(v[0]) + m[1] * static_cast<double>(v[1]) +
                                       m[2] * static_cast<double>(v[2]);
      }
  for (Index c = 0; c < 3; ++c) {
    const double* p = (c == 0 ? plan.luma : plan.chroma).data();
    for (Index i = 0; i < kJpegBlock; ++i)
      for (Index j = 0; j < kJpegBlock; ++j) {
        double sum = 0;
        for (Index k = 0; k < kJpegBlock; ++k) sum += plane[c][i * kJpegBlock + k] * p[k * kJpegBlock + j];
        half[i * kJpegBlock + j] = sum;
      }
    for (Index i = 0; i < kJpegBlock; ++i)
      for (Index j = 0; j < kJpegBlock; ++j) {
        double sum = 0;
        for (Index k = 0; k < kJpegBlock; ++k) sum += p[i * kJpegBlock + k] * half[k * kJpegBlock + j];
        plane[c][i * kJpegBlock + j] = sum;
      }
  }
  for (Index i = 0; i < kJpegBlock; ++i)
    for (Index j = 0; j < kJpegBlock; ++j)
      for (Index c = 0; c < 3; ++c) {
        const double* m = plan.out.data() + 3 * c;
        const Index q = i * kJpegBlock + j;
        T& to = y[i * row + 3 * j + c];
        const T value = static_cast<T>(m[0] * plane[0][q] + m[1] * plane[1][q] + m[2] * plane[2][q]);
        to = add ? to + value : value;
      }
}

template <class T>
void filter(const JpegPlan& plan, const T* x, T* y, const Shape& s, bool add) {
  const Index row = 3 * s[2], blocks = s[2] / kJpegBlock;
  parallel_for(s[0] * s[1] / kJpegBlock, 1, [&](Index b0, Index b1) {
    for (Index b = b0; b < b1; ++b)
      for (Index j = 0; j < blocks; ++j) {
        const Index at = b * kJpegBlock * row + 3 * kJpegBlock * j;
        filter_block(plan, x + at, y + at, row, add);
      }
  });
}

}  // namespace

template <class T>
Var<T> simulated_jpeg(Var<T> x, KeptFrequencies kept) {
  check_rank("simulated_jpeg", "x", x.shape(), 4, "[images, height, width, 3]");
  check_extent("simulated_jpeg", "x", x.shape(), 3, 3, "red, green, blue");
  const Shape s = x.shape();
  if (s[1] % kJpegBlock != 0 || s[2] % kJpegBlock != 0)
    throw ShapeError("[simulated_jpeg] x must have a height and a width of whole blocks of 8, got shape " +
                     s.str());
  if (kept.luma < 0 || kept.luma > kJpegBlock || kept.chroma < 0 || kept.chroma > kJpegBlock)
    throw ValueError("[simulated_jpeg] kept.luma and kept.chroma must be 0 to 8, got " +
                     std::to_string(kept.luma) + " and " + std::to_string(kept.chroma));
  Matrix3 to_ycc{};
  std::copy_n(kToYcc, 9, to_ycc.begin());
  const JpegPlan plan{to_ycc, inverse(kToYcc), projection(kept.luma), projection(kept.chroma)};
  T* y = nullptr;
  const Var<T> out = x.tape().output(s, &y, {x});
  filter(plan, x.value(), y, s, false);

  // dx = (C^-1 F C)^T dy = C^T F C^-T dy: F, the filter by P = P^T on both sides, is symmetric. A chunk owns
  // its rows of blocks.
  x.tape().on_backward(out, [x, s, plan](const T* dy) {
    const JpegPlan back{transposed(plan.out), transposed(plan.in), plan.luma, plan.chroma};
    filter(back, dy, x.grad_acc(), s, true);
  });
  return out;
}

template Var<float> simulated_jpeg(Var<float>, KeptFrequencies);
template Var<double> simulated_jpeg(Var<double>, KeptFrequencies);

}  // namespace fieldmark::baselines
