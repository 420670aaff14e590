#pragma once
#include <functional>

namespace fieldmark::bench {

/// Wall-clock time of one call.
struct Timing {
  double seconds = 0;  ///< median over the runs
  double least = 0, most = 0;
};

/// Calls `body` once to warm up, then `runs` times; where a call is shorter than `least_seconds`, a run is as
/// many calls as take that long, and counts as their mean.
/// @param runs  at least 1   @param least_seconds  >= 0   @throws ValueError otherwise
Timing time_calls(const std::function<void()>& body, int runs = 5, double least_seconds = 0.1);

/// Fused multiply-adds that this machine does in a second with the threads and the instruction set in use, in
/// GFLOP/s: the best of several runs on registers alone, on all threads at once.
double peak_gflops();

/// Most memory this process has had so far, megabytes; 0 where the system does not say.
double peak_megabytes();

}  // namespace fieldmark::bench
