#include "kernels/gemm_bf16.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "support/bf16.h"
#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
// Rounds to the nearest number with 8 significant bits, by arithmetic on the value.
double nearest(float x) {
  int exponent = 0;
  const double mantissa = std::frexp(static_cast<double>(x), &exponent);
  return std::ldexp(std::nearbyint(std::ldexp(mantissa, 8)), exponent - 8);
}

// Returns the units to test at this level: the plain loop on v2 and v3, all that the CPU has on v4.
std::vector<bool> units() {
  if (isa() != Isa::v4) return {false};
  if (!bf16_or_skip("gemm_bf16: AVX-512")) return {};
  return bf16_units() == Bf16Units::tiles ? std::vector<bool>{false, true} : std::vector<bool>{false};
}

// Returns the worst difference from a loop in double over rounded numbers, relative to the sum of absolute
// products.
double worst_error(Index m, Index n, Index k, bool tiles, bool accumulate, bool bias, bool relu, bool mask) {
  using namespace kernels;
  const Index a_row = k + 3, ldc = n + 5;
  const auto a = uniform<float>({m, a_row}, -1, 1, 1), b = uniform<float>({k, n}, -1, 1, 2),
             start = uniform<float>({m, ldc}, -1, 1, 3), row = uniform<float>({n}, -1, 1, 4),
             shut = uniform<float>({m, ldc}, -1, 1, 5);
  std::vector<std::uint16_t> packed(static_cast<std::size_t>(bf16_size(k, n)));
  std::vector<float> c(start.data);
  FIELDMARK_KERNEL(pack_bf16)(b.data.data(), k, n, n, 1, packed.data());
  FIELDMARK_KERNEL(gemm_bf16)
  ({.m = m,
    .n = n,
    .k = k,
    .a = a.data.data(),
    .a_row = a_row,
    .b = packed.data(),
    .c = c.data(),
    .ldc = ldc,
    .bias = bias ? row.data.data() : nullptr,
    .mask = mask ? shut.data.data() : nullptr,
    .accumulate = accumulate,
    .relu = relu,
    .tiles = tiles});
  double worst = 0;
  for (Index i = 0; i < m; ++i)
    for (Index j = 0; j < ldc; ++j) {
      const double got = c[static_cast<std::size_t>(i * ldc + j)];
      if (j >= n) {
        if (got != start[i * ldc + j]) return 1;  // wrote outside the matrix
        continue;
      }
      double sum = accumulate ? start[i * ldc + j] : bias ? row[j] : 0, size = 1;
      for (Index d = 0; d < k; ++d) {
        const double product = nearest(a[i * a_row + d]) * nearest(b[d * n + j]);
        sum += product;
        size += std::abs(product);
      }
      if (mask && !(shut[i * ldc + j] > 0)) sum = 0;
      if (relu) sum = std::max(sum, 0.0);
      raise_to(worst, std::abs(got - sum) / size);
    }
  return worst;
}
}  // namespace

TEST_CASE(
    "gemm_bf16: every extent and option on every unit this CPU has, against a loop over rounded numbers") {
  each_isa([] {
    for (const bool tiles : units())
      for (Index e = 1; e <= 130; ++e) {
        CAPTURE(tiles, e);
        CHECK(worst_error(e, 37, 29, tiles, false, true, true, false) < 1e-6);
        CHECK(worst_error(33, e, 17, tiles, true, false, false, true) < 1e-6);
        CHECK(worst_error(13, 21, e, tiles, false, false, false, false) < 1e-6);
      }
    for (const bool tiles : units()) CHECK(worst_error(40, 40, 1100, tiles, true, false, true, true) < 1e-6);
  });
}

TEST_CASE("gemm_bf16: numbers are rounded to nearest even, infinities and what is no number stay so") {
  each_isa([] {
    if (isa() == Isa::v4 && !bf16_or_skip("gemm_bf16: rounding with AVX-512")) return;
    const auto as_float = [](std::uint16_t bits) {
      const std::uint32_t wide = static_cast<std::uint32_t>(bits) << 16;
      float f;
      std::memcpy(&f, &wide, sizeof f);
      return f;
    };
    const std::vector<float> x{0.f,         1.f,
                               1.00390625f,  // half-way to the next: to even, 1
                               1.01171875f,  // half-way: to even, 1.015625
                               -3.1415927f, 3.4e38f, HUGE_VALF, -HUGE_VALF, std::nanf("")};
    std::vector<std::uint16_t> out(x.size());
    using namespace kernels;
    FIELDMARK_KERNEL(round_bf16)(x.data(), static_cast<std::int64_t>(x.size()), out.data());
    const std::vector<float> want{0.f, 1.f, 1.f, 1.015625f, -3.140625f, HUGE_VALF, HUGE_VALF, -HUGE_VALF};
    for (std::size_t i = 0; i < want.size(); ++i) CHECK(as_float(out[i]) == want[i]);
    CHECK(std::isnan(as_float(out.back())));
  });
}
