#include "cli/long_run.h"

#include "cli/cli.h"
#include "cli/context.h"

namespace fieldmark::cli {
namespace {

[[noreturn]] void interrupt(const Work& work) {
  const std::string steps = "after " + std::to_string(work.steps()) + " steps";
  if (!work.save) throw Interrupted(steps + ", nothing was written");
  work.save();
  throw Interrupted(steps + ", --resume continues from " + work.checkpoint);
}

}  // namespace

void add_run_length(CommandLine& app, RunLength& length, bool checkpoint) {
  Option steps =
      app.add_option("--steps", length.steps, "Length of the run in steps, 1 to 10000000; default: --seconds")
          ->range(1, 10000000)
          ->type_name("N")
          ->default_str("");
  app.add_option("--seconds", length.seconds,
                 "Length of the run in seconds from the start of the command, 1 to 1000000")
      ->range(1.0, 1e6)
      ->excludes(steps)
      ->type_name("S");
  if (!checkpoint) return;
  app.add_option("--checkpoint-seconds", length.checkpoint_seconds,
                 "Time between checkpoints in seconds, 1 to 1000000")
      ->range(1.0, 1e6)
      ->type_name("S");
}

double run_long(const Work& work, const RunLength& length, Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress(work.what);
  double saved = context.seconds();
  while (!work.done()) {
    if (guard.interrupted()) interrupt(work);
    const double now = context.seconds();
    if (work.save && now - saved > length.checkpoint_seconds) {
      work.save();
      saved = context.seconds();
    }
    work.step(now);
    const double part = length.steps > 0
                            ? static_cast<double>(work.steps()) / static_cast<double>(length.steps)
                            : now / length.seconds;
    progress.update(part, "step " + std::to_string(work.steps()) + "  " + work.note());
  }
  return context.seconds();
}

}  // namespace fieldmark::cli
