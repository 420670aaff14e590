#pragma once
#include <fieldmark/engine/training_run.h>

#include "cli/command_line.h"

namespace fieldmark::cli {

class Context;

/// Length of a run and interval between checkpoints.
struct RunLength {
  Index steps = 0;  ///< 0: by time
  double seconds = 60;
  double checkpoint_seconds = 60;
  double from = 0;  ///< seconds of the command at which the run's clock starts
};
/// Adds --steps and --seconds, and with `checkpoint` also --checkpoint-seconds.
/// @param seconds  the default of --seconds in words, if it depends on other options; empty: length.seconds
void add_run_length(CommandLine& app, RunLength& length, bool checkpoint, const std::string& seconds = {});

/// Runs training to its end, shows progress, and saves checkpoints at intervals and on Ctrl-C.
/// @param what  label of the progress   @param checkpoint  file name; empty: the run is not saved
/// @param enough  ends the run early, see DriveOptions
/// @return seconds since the command began   @throws Interrupted after saving
double run_long(TrainingRun& run, const std::string& what, const RunLength& length, Context& context,
                const std::string& checkpoint = {}, std::function<bool()> enough = {});

}  // namespace fieldmark::cli
