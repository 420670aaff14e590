#include <fieldmark/baselines/timed_run.h>

#include <algorithm>

namespace fieldmark::baselines {

double timed_run(TrainingRun& run, const std::string& what, double seconds,
                 const std::filesystem::path& checkpoint, const RunProgress& progress) {
  if (std::filesystem::exists(checkpoint)) run.restore(checkpoint);
  const bool complete =
      run.drive({.checkpoint = checkpoint, .curve_seconds = seconds / 200, .proceed = [&] {
                   return !progress || progress(what, std::min(run.seconds() / seconds, 1.0),
                                                "step " + std::to_string(run.steps()) + ", " + run.status());
                 }});
  if (!complete) throw Stopped(what + ": stopped after " + std::to_string(run.steps()) + " steps, saved");
  run.save(checkpoint);
  return run.seconds();
}

}  // namespace fieldmark::baselines
