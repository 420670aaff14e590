#include "kernels/few_outputs.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/catch.h"
#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
enum class Start { zero, bias, accumulate };

// Returns the worst difference of a row from a plain loop in double, relative to the sum of absolute
// products; 1 if the row went on beyond its end.
template <class T>
double worst_error(Index pixels, Index channels, Index outputs, Index window, Start start, bool relu) {
  using namespace kernels;
  const Index plane = (pixels + 63) / 64 * 64 + window - 1, row = channels * plane;
  const auto x = uniform<T>({window * row}, -1, 1, 1),
             w = uniform<T>({window, window, channels, outputs}, -1, 1, 2),
             before = uniform<T>({pixels * outputs + 1}, -1, 1, 3), bias = uniform<T>({outputs}, -1, 1, 4);
  std::vector<T> y(before.data);
  FIELDMARK_KERNEL(few_outputs<T>)
  ({.pixels = pixels,
    .channels = channels,
    .outputs = outputs,
    .window = window,
    .x = x.data.data(),
    .row = row,
    .plane = plane,
    .w = w.data.data(),
    .bias = start == Start::bias ? bias.data.data() : nullptr,
    .accumulate = start == Start::accumulate,
    .relu = relu,
    .y = y.data()});
  if (y.back() != before.data.back()) return 1;
  double worst = 0;
  for (Index at = 0; at < pixels * outputs; ++at) {
    const Index j = at / outputs, o = at % outputs;
    double sum = start == Start::accumulate ? before[at] : start == Start::bias ? bias[o] : 0, size = 1;
    for (Index k = 0; k < window * window * channels; ++k) {
      const Index c = k % channels, v = k / channels % window, u = k / (channels * window);
      const double product = double(x[u * row + c * plane + j + v]) * double(w[k * outputs + o]);
      sum += product;
      size += std::abs(product);
    }
    if (relu) sum = std::max(sum, 0.0);
    raise_to(worst, std::abs(double(y[static_cast<std::size_t>(at)]) - sum) / size);
  }
  return worst;
}

template <class T>
void check_all(double most) {
  using namespace kernels;
  const Index outputs = FIELDMARK_KERNEL(most_few_outputs<T>)();
  for (Index o = 1; o <= outputs; ++o)
    for (const Start start : {Start::zero, Start::bias, Start::accumulate})
      for (const bool relu : {false, true}) {
        CAPTURE(o, static_cast<int>(start), relu);
        for (Index pixels = 1; pixels <= 131; ++pixels) {
          CAPTURE(pixels);
          CHECK(worst_error<T>(pixels, 5, o, 3, start, relu) < most);
        }
        for (const Index channels : {1, 2, 64}) CHECK(worst_error<T>(37, channels, o, 5, start, relu) < most);
      }
}
}  // namespace

TEST_CASE(
    "few_outputs: every length of a row, start and ReLU on every instruction set against a plain loop") {
  each_isa([] {
    check_all<float>(1e-6);
    check_all<double>(1e-15);
  });
}

TEST_CASE("few_outputs: planes hold each channel of the pixels, and 0 where a ReLU was shut") {
  const auto check = []<class T>(T) {
    using namespace kernels;
    for (const Index channels : {1, 3, 4, 7, 16})
      for (Index pixels = 1; pixels < 20; ++pixels)
        for (const bool masked : {false, true}) {
          CAPTURE(channels, pixels, masked);
          const Index plane = pixels + 3;
          const auto x = uniform<T>({pixels, channels}, -1, 1, 1),
                     mask = uniform<T>({pixels, channels}, -1, 1, 2);
          std::vector<T> got(static_cast<std::size_t>(channels * plane), T(9)), want = got;
          for (Index j = 0; j < pixels; ++j)
            for (Index c = 0; c < channels; ++c) {
              const Index at = j * channels + c;
              want[static_cast<std::size_t>(c * plane + j)] = masked && mask[at] <= 0 ? T(0) : x[at];
            }
          FIELDMARK_KERNEL(pixel_planes<T>)
          (x.data.data(), masked ? mask.data.data() : nullptr, pixels, channels, plane, got.data());
          CHECK(got == want);
        }
  };
  each_isa([&] {
    check(float{});
    check(double{});
  });
}

TEST_CASE("few_outputs: a NaN reaches every pixel whose window has it, through a ReLU, and no other") {
  each_isa([] {
    using namespace kernels;
    const Index pixels = 70, plane = 130;
    for (Index at = 0; at < pixels + 2; ++at) {
      std::vector<float> x(3 * plane, 1.f), y(pixels, 0.f);
      const std::vector<float> w(9, 1.f);
      x[static_cast<std::size_t>(plane + at)] = std::nanf("");
      FIELDMARK_KERNEL(few_outputs<float>)
      ({.pixels = pixels,
        .channels = 1,
        .outputs = 1,
        .window = 3,
        .x = x.data(),
        .row = plane,
        .plane = plane,
        .w = w.data(),
        .relu = true,
        .y = y.data()});
      for (Index j = 0; j < pixels; ++j) {
        const bool sees = j <= at && at <= j + 2;
        if (std::isnan(y[static_cast<std::size_t>(j)]) != sees)
          FAIL("pixel " << j << " with a NaN at " << at << ": " << y[static_cast<std::size_t>(j)]);
      }
    }
  });
}
