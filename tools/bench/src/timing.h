#pragma once
#include <functional>
#include <vector>

namespace fieldmark::bench {

/// Wall-clock time of one call.
struct Timing {
  double seconds = 0;          ///< median over the runs
  double least = 0;            ///< fastest run, seconds
  double most = 0;             ///< slowest run, seconds
  double peak_operations = 0;  ///< that the machine's peak would have done meanwhile, median over the runs
};

/// Seconds of a clock that is never set, from some moment on.
double now();

/// Calls `body` once to warm up, then `runs` times; where a call is shorter than `least_seconds`, a run is as
/// many calls as take that long, and counts as their mean. The peak is measured in bursts of 0.3 ms right
/// before and after each run, because a shared machine's speed drifts within minutes, and the clock also
/// depends on what was just run and takes milliseconds to change.
/// @param runs  at least 1   @param least_seconds  >= 0   @throws ValueError otherwise
/// @param between  called after every run, outside of its time: for something else to be timed
///                 by turns. Only the peak after a run counts then
Timing time_calls(const std::function<void()>& body, int runs = 5, double least_seconds = 0.1,
                  const std::function<void()>& between = {});

/// Half of the sorted numbers are on either side of it. @throws ValueError if there are none
double median(std::vector<double> numbers);

/// Fused multiply-adds that this machine does in a second with the threads and the instruction set in use, in
/// GFLOP/s: on registers alone, on all threads at once; median of several bursts.
/// @param bursts  at least 1   @param seconds  of each, > 0
double peak_gflops(int bursts = 9, double seconds = 0.02);

/// Most memory this process has had so far, megabytes; 0 where the system does not say.
double peak_megabytes();

}  // namespace fieldmark::bench
