#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/trainer.h>

#include <ostream>
#include <utility>

#include "cli/bench.h"
#include "cli/long_run.h"
#include "cli/shared_data.h"

namespace fieldmark::cli {
namespace {

constexpr Index kSceneSize = 200, kSceneViews = 50;  // of the built-in scene

struct Subject {
  const char *name, *help;
  Command (*add)(CommandLine&);
};
constexpr Subject kSubjects[] = {
    {"engine", "Measure kernels and training steps against the peak of this machine", add_bench_engine},
    {"field", "Compare rendering settings: speed against error", add_bench_field},
    {"training", "Compare training settings at equal training time", add_bench_training},
    {"embed", "Compare embedding settings at equal training time: accuracy against mark PSNR",
     add_bench_embed},
    {"payload", "Measure how often payloads are read exactly, and how often noise decodes to one",
     add_bench_payload},
    {"attacks", "Measure bit accuracy against the damage that attacks do to images and fields",
     add_bench_attacks},
    {"tracing", "Measure how many recipients of mixed copies are named, and how many innocent ones",
     add_bench_tracing},
    {"collapse", "Measure how soon collapses are detected, and how many healthy trainings raise alarms",
     add_bench_collapse},
    {"captures",
     "Measure the gain of exposures and refined poses on captured images, with and without jittered poses",
     add_bench_captures},
    {"data", "Measure the PSNR lost on data sets in other forms: opaque, moved, masked, behind a lens",
     add_bench_data},
    {"turns", "Compare the wall time of a command in this build and in another, in alternation",
     add_bench_turns}};

}  // namespace

Option add_file(CommandLine& app, const char* name, std::string& value, const char* help, const char* type) {
  return app.add_option(name, value, help)->type_name(type)->default_str("");
}

void add_scene_option(CommandLine& app, std::string& scene) {
  app.add_option("--scene", scene, "Data set to measure on")
      ->type_name("DIR")
      ->default_str("lego of FIELDMARK_DATA, else the built-in scene");
}

void add_plot(CommandLine& app, std::string& plot) {
  add_file(app, "--plot", plot, "SVG file to write with a chart of the rows; default: none", "FILE");
}

nerf::Dataset bench_split(const std::string& folder, const std::string& split, bool quick) {
  const std::string path = folder.empty() ? shared_data("nerf_synthetic/lego").string() : folder;
  if (!path.empty()) return nerf::load_dataset(path, {.split = split});
  const Index part = quick ? 8 : 1;
  return nerf::make_scene({.size = kSceneSize / part, .views = kSceneViews / part}, split);
}

std::unique_ptr<nerf::RadianceField> trained_field(const nerf::Dataset& data, double seconds,
                                                   Context& context) {
  nerf::RadianceFieldOptions sizes = nerf::field_options({.seconds = seconds});
  sizes.seed = context.seed();
  auto field = std::make_unique<nerf::RadianceField>(sizes);
  const double begin = context.seconds();
  nerf::Trainer trainer(*field, data, {.schedule = {.seconds = seconds}, .seed = context.seed()});
  run_long(trainer, "train", {.seconds = seconds, .from = begin}, context);
  return field;
}

Command add_bench(CommandLine& app) {
  std::vector<std::pair<CommandLine, Command>> subjects;
  for (const Subject& subject : kSubjects) {
    CommandLine sub = app.add_subcommand(subject.name, subject.help);
    Command command = subject.add(sub);
    subjects.emplace_back(sub, std::move(command));
  }
  return [subjects](Context& context) {
    for (const auto& [sub, command] : subjects)
      if (sub.parsed()) return command(context);
    return static_cast<int>(kUsage);
  };
}

}  // namespace fieldmark::cli
