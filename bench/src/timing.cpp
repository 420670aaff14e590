#include <fieldmark/bench/timing.h>
#include <fieldmark/engine/error.h>
#include <fieldmark/engine/parallel.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "kernels/fma_peak.h"

namespace fieldmark::bench {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

Timing time_calls(const std::function<void()>& body, int runs, double least_seconds) {
  if (runs < 1 || !(least_seconds >= 0))
    throw ValueError("[time_calls] runs must be at least 1 and least_seconds at least 0, got " +
                     std::to_string(runs) + " and " + std::to_string(least_seconds));
  double begin = now();
  body();
  const double first = std::max(now() - begin, 1e-9);
  const auto calls = static_cast<int>(std::clamp(least_seconds / first, 1.0, 1e6));
  std::vector<double> seconds;
  for (int r = 0; r < runs; ++r) {
    begin = now();
    for (int i = 0; i < calls; ++i) body();
    seconds.push_back((now() - begin) / calls);
  }
  std::sort(seconds.begin(), seconds.end());
  const std::size_t middle = seconds.size() / 2;
  const double median = seconds.size() % 2 ? seconds[middle] : (seconds[middle - 1] + seconds[middle]) / 2;
  return {median, seconds.front(), seconds.back()};
}

double peak_gflops() {
  using namespace kernels;
  constexpr std::int64_t kRounds = 1 << 20;
  const auto run = FIELDMARK_KERNEL(fma_peak_f32);
  const int n = threads();
  double operations = 0;
  const Timing t = time_calls(
      [&] {
        std::vector<double> each(static_cast<std::size_t>(n));
        parallel_for(n, 1, [&](Index i, Index) { each[static_cast<std::size_t>(i)] = run(kRounds); });
        operations = 0;
        for (double o : each) operations += o;
      },
      9, 0.02);
  return operations / t.least * 1e-9;
}

double peak_megabytes() {
  rusage usage{};
  return getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<double>(usage.ru_maxrss) / 1024 : 0;
}

}  // namespace fieldmark::bench
