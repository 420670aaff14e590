#pragma once
#include <fieldmark/engine/shape.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// Two builds of a program and the command to time in both.
struct TurnsOptions {
  std::string ours{}, theirs{};          ///< the programs
  std::vector<std::string> arguments{};  ///< of both; "{}" in them stands for an empty folder of each run
  Index runs = 5;                        ///< of each program, at least 1
  double limit_seconds = 3600;           ///< of one run, > 0
};

/// Wall times of the runs, in seconds, in their order.
struct Turns {
  std::vector<double> ours{}, theirs{};
};

/// Ours over theirs.
struct TurnsRatio {
  double median = 0, low = 0, high = 0;  ///< of the pairs of runs
  double of_least = 0;                   ///< of the fastest run of each program
};

/// Runs both programs by turns. Each pair begins with the program that ended the one before, so that a
/// machine that slows down or speeds up does not favour either.
/// @param progress  called with the share of the runs done, several times a second; may throw to give up
/// @throws IoError if a program cannot be started, fails or takes too long
Turns take_turns(const TurnsOptions& options, const std::function<void(double)>& progress);

/// @throws ValueError unless both programs have the same number of runs, at least 1
TurnsRatio ratio_of(const Turns& turns);

}  // namespace fieldmark::bench
