#pragma once
#include <fieldmark/engine/shape.h>

#include <functional>
#include <string>

#include "cli/command_line.h"

namespace fieldmark::cli {

class Context;

/// How long a run is, and how often it is saved.
struct RunLength {
  Index steps = 0;  ///< 0: by time
  double seconds = 60;
  double checkpoint_seconds = 60;
};
/// Adds --steps and --seconds, and with `checkpoint` --checkpoint-seconds.
void add_run_length(CommandLine& app, RunLength& length, bool checkpoint);

/// Work in steps, as the library's trainers offer it.
struct Work {
  std::string what;                   ///< shown before the progress
  std::function<bool()> done;         ///< whether it is at its end
  std::function<void(double)> step;   ///< takes one step, given the seconds since the command began
  std::function<Index()> steps;       ///< taken so far
  std::function<std::string()> note;  ///< shown behind the progress
  std::function<void()> save;         ///< writes `checkpoint`; empty where the work cannot be resumed
  std::string checkpoint;
};

/// Takes steps until the work is done, shows progress, saves now and then and when the user presses Ctrl-C.
/// @return seconds since the command began   @throws Interrupted after saving
double run_long(const Work& work, const RunLength& length, Context& context);

}  // namespace fieldmark::cli
