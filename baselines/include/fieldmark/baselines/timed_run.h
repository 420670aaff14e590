#pragma once
#include <fieldmark/core/error.h>
#include <fieldmark/engine/training_run.h>

#include <filesystem>
#include <functional>
#include <string>

namespace fieldmark::baselines {

/// A run was stopped from outside, after a checkpoint.
class Stopped : public Error {
 public:
  using Error::Error;
};

/// Told the work, its progress (0 to 1) and a note; false stops the work.
using RunProgress = std::function<bool(const std::string& what, double part, const std::string& note)>;

/// Drives a run of training that lasts a number of seconds, of training alone, earlier processes included.
/// Resumes from the checkpoint if there is one, and leaves the checkpoint of the complete run.
/// @param what  for progress   @param seconds  length, for progress and for the 200 points of the curve
/// @return seconds of training   @throws Stopped after saving, if progress says so   @throws IoError
double timed_run(TrainingRun& run, const std::string& what, double seconds,
                 const std::filesystem::path& checkpoint, const RunProgress& progress);

}  // namespace fieldmark::baselines
