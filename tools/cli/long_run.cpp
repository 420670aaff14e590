#include "cli/long_run.h"

#include <fieldmark/core/files.h>

#include "cli/cli.h"
#include "cli/context.h"

namespace fieldmark::cli {

void add_run_length(CommandLine& app, RunLength& length, bool checkpoint, const std::string& seconds) {
  Option steps =
      app.add_option("--steps", length.steps,
                     "Length of the run in steps, 1 to 10000000; default: as many as --seconds allows")
          ->range(1, 10000000)
          ->type_name("N")
          ->default_str("");
  std::string help = "Length of the run in seconds from the start of the command, 1 to 1000000";
  if (!seconds.empty()) help += "; default: " + seconds;
  Option time =
      app.add_option("--seconds", length.seconds, help)->range(1.0, 1e6)->excludes(steps)->type_name("S");
  if (!seconds.empty()) time->default_str("");
  if (!checkpoint) return;
  app.add_option("--checkpoint-seconds", length.checkpoint_seconds,
                 "Time between checkpoints in seconds, 1 to 1000000")
      ->range(1.0, 1e6)
      ->type_name("S");
}

double run_long(TrainingRun& run, const std::string& what, const RunLength& length, Context& context,
                const std::string& checkpoint, std::function<bool()> enough) {
  if (!checkpoint.empty()) AtomicFile{checkpoint};  // fails now, not at the first save
  const InterruptGuard guard;
  Progress progress = context.progress(what);
  const double earlier = run.seconds();  // of the runs that this one resumes
  // A resumed run that has fixed its number of steps ends by it, whatever the clock of this process says.
  const Index steps = length.steps > 0 ? length.steps : run.planned();
  if (length.steps == 0 && run.planned() > 0)
    context.note("the interrupted run fixed its length at " + std::to_string(run.planned()) +
                 " steps, so --seconds does not change it");
  const auto tell = [&](double now) {
    const double part =
        steps > 0 ? static_cast<double>(run.steps()) / static_cast<double>(steps) : now / length.seconds;
    progress.update(part, "step " + std::to_string(run.steps()) + "  " + run.status());
  };
  const bool complete = run.drive({.checkpoint = checkpoint,
                                   .checkpoint_seconds = length.checkpoint_seconds,
                                   .clock = [&] { return context.seconds() - length.from; },
                                   .enough = std::move(enough),
                                   .proceed = [&] { return !guard.interrupted(); },
                                   .after = tell});
  if (complete) return earlier + context.seconds();
  throw Interrupted(
      "after " + std::to_string(run.steps()) + " steps" +
      (checkpoint.empty() ? ", nothing was written" : ", --resume continues from " + checkpoint));
}

}  // namespace fieldmark::cli
