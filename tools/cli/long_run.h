#pragma once
#include <fieldmark/engine/training_run.h>

#include "cli/command_line.h"

namespace fieldmark::cli {

class Context;

/// How long a run is, and how often it is saved.
struct RunLength {
  Index steps = 0;  ///< 0: by time
  double seconds = 60;
  double checkpoint_seconds = 60;
  double from = 0;  ///< seconds of the command at which the run's clock starts
};
/// Adds --steps and --seconds, and with `checkpoint` --checkpoint-seconds.
void add_run_length(CommandLine& app, RunLength& length, bool checkpoint);

/// Drives a run to its end, shows progress, and saves it from time to time and at Ctrl-C.
/// @param what  shown before the progress   @param checkpoint  its file; empty: the run is not saved
/// @param enough  ends the run early, see DriveOptions
/// @return seconds since the command began   @throws Interrupted after saving
double run_long(TrainingRun& run, const std::string& what, const RunLength& length, Context& context,
                const std::string& checkpoint = {}, std::function<bool()> enough = {});

}  // namespace fieldmark::cli
