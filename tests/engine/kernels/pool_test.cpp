#include "kernels/pool.h"

#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

namespace fieldmark::kernels {
namespace {

// Checks windows of size x size, with one pixel left over at the end of each row.
void check_windows(std::int64_t windows, std::int64_t size, std::int64_t channels) {
  const PoolRow p{windows, size, channels, (windows * size + 1) * channels};
  const auto x = uniform<float>({size * p.row}, -1, 1, 1),
             dy = uniform<float>({windows * channels}, -1, 1, 2);
  std::vector<float> y(static_cast<std::size_t>(windows * channels) + 1, 7.f);
  std::vector<float> fresh(static_cast<std::size_t>(size * p.row) + 1, 7.f), held = fresh;
  FIELDMARK_KERNEL(pool_row<float>)(p, x.data.data(), y.data());
  FIELDMARK_KERNEL(pool_row_backward<float>)(p, dy.data.data(), fresh.data(), false);
  FIELDMARK_KERNEL(pool_row_backward<float>)(p, dy.data.data(), held.data(), true);
  double worst = 0;
  for (std::int64_t o = 0; o < windows * channels; ++o) {
    double sum = 0;
    for (std::int64_t i = 0; i < size; ++i)
      for (std::int64_t j = 0; j < size; ++j)
        sum += x[i * p.row + (o / channels * size + j) * channels + o % channels];
    raise_to(worst, std::abs(y[static_cast<std::size_t>(o)] - sum / double(size * size)));
  }
  for (std::int64_t k = 0; k < size * p.row; ++k) {
    const std::int64_t column = k % p.row / channels, window = column / size;
    const double want = window < windows ? dy[window * channels + k % channels] / double(size * size) : 0.0;
    raise_to(worst, std::abs(fresh[static_cast<std::size_t>(k)] - want));
    raise_to(worst, std::abs(held[static_cast<std::size_t>(k)] - 7 - want));
  }
  CAPTURE(windows, size, channels);
  CHECK(worst < 1e-6);
  CHECK((y.back() == 7 && fresh.back() == 7 && held.back() == 7));
}

}  // namespace

TEST_CASE("kernels/pool: windows, for every number of channels") {
  each_isa([] {
    for (std::int64_t channels = 1; channels <= 130; ++channels) check_windows(3, 2, channels);
    for (std::int64_t size : {1, 3, 5}) check_windows(4, size, 17);
    check_windows(0, 2, 5);
  });
}

TEST_CASE("kernels/pool: sums over pixels and their transpose, for every number of channels") {
  each_isa([] {
    for (std::int64_t channels = 1; channels <= 130; ++channels) {
      const std::int64_t pixels = 131 - channels;
      const auto x = uniform<float>({pixels * channels}, -1, 1, 1);
      const auto mask = uniform<float>({pixels * channels}, -1, 1, 2);
      std::vector<double> want(static_cast<std::size_t>(channels)), want_part = want;
      std::vector<double> sums(want.size() + 1, 7.), part = sums;
      FIELDMARK_KERNEL(channel_sums<float>)(x.data.data(), nullptr, pixels, channels, sums.data());
      FIELDMARK_KERNEL(channel_sums<float>)
      (x.data.data(), mask.data.data(), pixels, channels, part.data());
      Tensor<float> fresh({pixels * channels}), held = x;
      FIELDMARK_KERNEL(fill_pixels<float>)(x.data.data(), pixels, channels, fresh.data.data(), false);
      FIELDMARK_KERNEL(fill_pixels<float>)(x.data.data(), pixels, channels, held.data.data(), true);
      double worst = 0;
      for (std::int64_t i = 0; i < x.size(); ++i) {
        const float row = x[i % channels];
        want[static_cast<std::size_t>(i % channels)] += x[i];
        want_part[static_cast<std::size_t>(i % channels)] += mask[i] > 0 ? x[i] : 0;
        raise_to(worst, std::abs(static_cast<double>(fresh[i] - row)));
        raise_to(worst, std::abs(static_cast<double>(held[i] - (x[i] + row))));
      }
      CAPTURE(channels);
      CHECK(worst == 0);
      CHECK(sums.back() == 7);
      CHECK(part.back() == 7);
      for (std::size_t c = 0; c < want.size(); ++c) {
        CHECK(std::abs(sums[c] - want[c]) < 1e-5);
        CHECK(std::abs(part[c] - want_part[c]) < 1e-5);
      }
    }
  });
}

}  // namespace fieldmark::kernels
