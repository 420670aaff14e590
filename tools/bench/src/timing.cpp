#include "timing.h"
#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/parallel.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <numeric>
#include <string>
#include <vector>

#include "kernels/fma_peak.h"

namespace fieldmark::bench {
namespace {

constexpr double kBurst = 3e-4;  // seconds; the clock rate is constant for longer than that

}  // namespace

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double median(std::vector<double> numbers) {
  if (numbers.empty()) throw ValueError("[median] numbers must not be empty");
  std::sort(numbers.begin(), numbers.end());
  const std::size_t middle = numbers.size() / 2;
  return numbers.size() % 2 ? numbers[middle] : (numbers[middle - 1] + numbers[middle]) / 2;
}

Timing time_calls(const std::function<void()>& body, int runs, double least_seconds,
                  const std::function<void()>& between) {
  if (runs < 1 || !(least_seconds >= 0))
    throw ValueError("[time_calls] runs must be at least 1 and least_seconds at least 0, got " +
                     std::to_string(runs) + " and " + number_text(least_seconds));
  double begin = now();
  body();
  const double first = std::max(now() - begin, 1e-9);
  const auto calls = static_cast<int>(std::clamp(least_seconds / first, 1.0, 1e6));
  std::vector<double> seconds, operations;
  double before = peak_gflops(1, kBurst);
  for (int r = 0; r < runs; ++r) {
    begin = now();
    for (int i = 0; i < calls; ++i) body();
    seconds.push_back((now() - begin) / calls);
    const double after = peak_gflops(1, kBurst);
    operations.push_back(seconds.back() * ((between ? after : before) + after) / 2 * 1e9);
    before = after;
    if (between) between();
  }
  const auto [least, most] = std::minmax_element(seconds.begin(), seconds.end());
  return {median(seconds), *least, *most, median(operations)};
}

double peak_gflops(int bursts, double seconds) {
  using namespace kernels;
  constexpr std::int64_t kRounds = 1 << 9;
  const auto run = FIELDMARK_KERNEL(fma_peak_f32);
  const int n = threads();
  std::vector<double> rates;
  for (int b = 0; b < bursts; ++b) {
    std::vector<double> rate(static_cast<std::size_t>(n));
    parallel_for(n, 1, [&](Index i, Index) {
      const double begin = now();
      double operations = 0, passed = 0;
      while ((passed = now() - begin) < seconds) operations += run(kRounds);
      rate[static_cast<std::size_t>(i)] = operations / passed;
    });
    rates.push_back(std::accumulate(rate.begin(), rate.end(), 0.0) * 1e-9);
  }
  return median(rates);
}

double peak_megabytes() {
  rusage usage{};
  return getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<double>(usage.ru_maxrss) / 1024 : 0;
}

}  // namespace fieldmark::bench
