#pragma once
#include <functional>
#include <vector>

namespace fieldmark::bench {

/// Wall-clock time of a call.
struct Timing {
  double seconds = 0;          ///< median over the runs
  double least = 0;            ///< fastest run, seconds
  double most = 0;             ///< slowest run, seconds
  double peak_operations = 0;  ///< what the machine's peak would do in the same time, median over the runs
};

/// Returns the seconds of a monotonic clock.
double now();

/// Calls `body` once to warm up, then times `runs` runs. If a call is shorter than `least_seconds`, a run
/// repeats it for that long and counts the mean. The peak is measured in bursts of 0.3 ms right before and
/// after each run, because the speed of a shared machine drifts within minutes, and the CPU clock also
/// depends on the preceding work and takes milliseconds to change.
/// @param runs  at least 1   @param least_seconds  >= 0   @throws ValueError otherwise
/// @param between  called after every run, outside of its time, to time something else in alternation.
///                 Only the peak after a run counts then
Timing time_calls(const std::function<void()>& body, int runs = 5, double least_seconds = 0.1,
                  const std::function<void()>& between = {});

/// Returns the median of numbers. @throws ValueError if there are none
double median(std::vector<double> numbers);

/// Measures the fused multiply-adds per second of this machine with the threads and the instruction set in
/// use, in GFLOP/s: in registers alone, on all threads at once; median of several bursts.
/// @param bursts  at least 1   @param seconds  per burst, > 0
double peak_gflops(int bursts = 9, double seconds = 0.02);

/// Returns the peak memory of this process so far in megabytes; 0 if the system does not report it.
double peak_megabytes();

}  // namespace fieldmark::bench
