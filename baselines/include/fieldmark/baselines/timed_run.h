#pragma once
#include <fieldmark/core/error.h>
#include <fieldmark/engine/shape.h>

#include <filesystem>
#include <functional>
#include <string>

namespace fieldmark::baselines {

/// A run was stopped from outside, after what there was to save was saved.
class Stopped : public Error {
 public:
  using Error::Error;
};

/// Told what is being done, how far it is (0 to 1) and a note; false stops it.
using RunProgress = std::function<bool(const std::string& what, double part, const std::string& note)>;

/// Training of a given length in seconds that a later process can go on with.
struct TimedRun {
  std::string what;                  ///< for progress
  double seconds = 60;               ///< length, for progress alone: done() decides
  std::function<bool()> done;        ///< whether it is at its end
  std::function<void(double)> step;  ///< takes a step, given the seconds of training before it
  std::function<Index()> steps;      ///< taken so far
  std::function<double()> figure;    ///< what the curve follows, such as the share of bits right
  std::function<void(const std::filesystem::path&)> save;     ///< writes a checkpoint
  std::function<void(const std::filesystem::path&)> restore;  ///< reads one
  std::filesystem::path checkpoint;  ///< its name; beside it lie CHECKPOINT.seconds and CHECKPOINT.curve
  double save_every = 60;            ///< seconds between checkpoints
};

/// Takes steps until the run is done, from its checkpoint on where there is one; the clock counts the time of
/// training alone, that of earlier processes included. At the end the checkpoint is still there (and says
/// that the run is done): remove_run_files() when its result is safe.
/// @return seconds of training   @throws Stopped after saving, if progress says so   @throws IoError
double timed_run(const TimedRun& run, const RunProgress& progress);

/// "seconds,steps,figure" and some hundred lines of the course of a run that is done. @throws IoError
std::string run_curve(const std::filesystem::path& checkpoint);
/// Removes a run's files, those that there are.
void remove_run_files(const std::filesystem::path& checkpoint);

}  // namespace fieldmark::baselines
