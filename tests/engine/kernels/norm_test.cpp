#include "kernels/norm.h"

#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

namespace fieldmark::kernels {
namespace {

// One case with its plain result in double. Pixels start one number into their buffers, so that no address is
// vector-aligned.
struct Case {
  std::int64_t pixels, channels;
  Tensor<float> x, dy, mean, gain, shift, offset, slope;
  Case(std::int64_t p, std::int64_t c)
      : pixels(p),
        channels(c),
        x(uniform<float>({p * c + 1}, -2, 2, 1)),
        dy(uniform<float>({p * c + 1}, -1, 1, 2)),
        mean(uniform<float>({c}, -1, 1, 3)),
        gain(uniform<float>({c}, 0.5, 2, 4)),
        shift(uniform<float>({c}, -1, 1, 5)),
        offset(uniform<float>({c}, -1, 1, 6)),
        slope(uniform<float>({c}, -1, 1, 7)) {}
  Affine<float> affine(bool relu) const {
    return {mean.data.data(), gain.data.data(), shift.data.data(), relu};
  }
  double pre(std::int64_t i) const {
    const std::int64_t c = i % channels;
    return (double(x[i + 1]) - double(mean[c])) * double(gain[c]) + double(shift[c]);
  }
};

void check_case(const Case& k, bool relu) {
  const std::int64_t n = k.pixels * k.channels;
  std::vector<float> y(static_cast<std::size_t>(n) + 2, 7.f), dx = y, held = y;
  std::vector<double> want_sums(static_cast<std::size_t>(k.channels)), want_mixed = want_sums;
  std::vector<double> sums(want_sums.size() + 1, 7.), mixed = sums;
  const auto a = k.affine(relu);
  const float *x = k.x.data.data() + 1, *dy = k.dy.data.data() + 1;
  FIELDMARK_KERNEL(normalise<float>)(x, y.data() + 1, k.pixels, k.channels, a);
  FIELDMARK_KERNEL(norm_sums<float>)(x, dy, k.pixels, k.channels, a, sums.data(), mixed.data());
  const auto gradient = FIELDMARK_KERNEL(norm_gradient<float>);
  gradient(x, dy, dx.data() + 1, k.pixels, k.channels, a, k.offset.data.data(), k.slope.data.data(), false);
  gradient(x, dy, held.data() + 1, k.pixels, k.channels, a, k.offset.data.data(), k.slope.data.data(), true);
  double worst = 0;
  for (std::int64_t i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i + 1);
    const auto c = static_cast<std::size_t>(i % k.channels);
    const double centred = double(k.x.data[at]) - double(k.mean.data[c]), pre = k.pre(i);
    const double g = relu && pre <= 0 ? 0 : double(k.dy.data[at]);
    const double want = g * k.gain.data[c] - k.offset.data[c] - centred * k.slope.data[c];
    for (const double e : {std::abs(y[at] - (relu ? std::max(pre, 0.0) : pre)), std::abs(dx[at] - want),
                           std::abs(held[at] - 7 - want)})
      raise_to(worst, e);
    want_sums[c] += g;
    want_mixed[c] += g * centred;
  }
  for (std::size_t c = 0; c < want_sums.size(); ++c)
    for (const double e : {std::abs(sums[c] - want_sums[c]), std::abs(mixed[c] - want_mixed[c])})
      raise_to(worst, e);
  CAPTURE(k.pixels, k.channels, relu);
  CHECK(worst < 5e-6);  // values of magnitude up to 10
  for (const auto* to : {&y, &dx, &held}) CHECK((to->front() == 7 && to->back() == 7));
  CHECK((sums.back() == 7 && mixed.back() == 7));
}

}  // namespace

TEST_CASE("kernels/norm: every number of channels, and pixels that do and do not fill a segment") {
  each_isa([] {
    for (std::int64_t c = 1; c <= 130; ++c)
      for (std::int64_t p : {1, 31, 37}) {
        const Case k(p, c);
        check_case(k, false);
        check_case(k, true);
      }
    for (std::int64_t p = 1; p <= 130; ++p) check_case(Case(p, 19), true);
    check_case(Case(0, 5), true);
  });
}

TEST_CASE("kernels/norm: moments of pixels far from 0") {
  // 1000 +- 1e-3: a sum of squares in float would lose every digit of the variance.
  each_isa([] {
    for (std::int64_t channels = 1; channels <= 130; ++channels) {
      const std::int64_t pixels = channels % 50 == 1 ? 1001 : 131 - channels % 64;
      const auto noise = uniform<float>({pixels * channels}, -1e-3, 1e-3, 9);
      Tensor<float> x(noise.shape);
      for (std::int64_t i = 0; i < x.size(); ++i) x[i] = (i < channels ? 0.f : 1000.f) + noise[i];
      std::vector<double> mean(static_cast<std::size_t>(channels) + 1, 7.), m2 = mean;
      FIELDMARK_KERNEL(channel_moments<float>)
      (x.data.data() + channels, pixels - 1, channels, mean.data(), m2.data());
      for (std::int64_t c = 0; c < channels; ++c) {
        double m = 0, s = 0;
        for (std::int64_t p = 1; p < pixels; ++p) m += x[p * channels + c] / double(pixels - 1);
        for (std::int64_t p = 1; p < pixels; ++p) s += std::pow(double(x[p * channels + c]) - m, 2);
        const auto at = static_cast<std::size_t>(c);
        CHECK(std::abs(mean[at] - m) < 1e-9);
        CHECK(std::abs(m2[at] - s) < 1e-6 * s);
      }
      CHECK((mean.back() == 7 && m2.back() == 7));
    }
  });
}

TEST_CASE("kernels/norm: moments of constant pixels are exact") {
  each_isa([] {
    for (float v : {0.f, 0.1f, 1234.567f, -3e7f}) {
      const std::vector<float> x(1003 * 11, v);
      std::vector<double> mean(11), m2(11);
      FIELDMARK_KERNEL(channel_moments<float>)(x.data(), 1003, 11, mean.data(), m2.data());
      for (std::size_t c = 0; c < 11; ++c) {
        CHECK(mean[c] == double(v));
        CHECK(m2[c] == 0);
      }
    }
  });
}

}  // namespace fieldmark::kernels
