#pragma once
#include <fieldmark/core/error.h>
#include <fieldmark/engine/training_run.h>

#include <filesystem>
#include <functional>
#include <string>

namespace fieldmark::baselines {

/// The caller stopped the work. A run in training saved a checkpoint first; a measurement starts again.
class Stopped : public Error {
 public:
  using Error::Error;
};

/// Reports the work, its progress (0 to 1) and a note; return false to stop the work.
using RunProgress = std::function<bool(const std::string& what, double part, const std::string& note)>;

/// Runs training for a number of seconds, which count training time only, earlier processes included. Resumes
/// from the checkpoint if it exists, and leaves the checkpoint of the complete run.
/// @param what  label for progress   @param seconds  length, for progress and for the 200 points of the curve
/// @return seconds of training   @throws Stopped after saving, if progress returns false   @throws IoError
double timed_run(TrainingRun& run, const std::string& what, double seconds,
                 const std::filesystem::path& checkpoint, const RunProgress& progress);

}  // namespace fieldmark::baselines
