#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/collapse_watch.h>
#include <fieldmark/tools/bench/collapse_bench.h>

#include <algorithm>

#include "cli/bench.h"

namespace fieldmark::cli {
namespace {

constexpr double kBar = 10;  // seconds within which a collapse should be noticed

struct BenchCollapseArguments {
  std::vector<std::string> scenes;
  double seconds = 30, healthy = 5, patience = 15;
  Index ordinary = 50;
  bool quick = false;
};

// A scene with the images that the watch looks at.
struct WatchedScene {
  nerf::Dataset train, judge;
};

WatchedScene scene_in(const std::string& folder) {
  const std::string split = nerf::has_split(folder, "val") ? "val" : "test";
  nerf::Dataset train = nerf::load_dataset(folder, {.split = "train"});
  nerf::Dataset judge = nerf::load_dataset(folder, {.split = split,
                                                    .background = train.background,
                                                    .scene = train.scene,
                                                    .most_views = nerf::CollapseWatch::kViews});
  return {std::move(train), std::move(judge)};
}

std::vector<WatchedScene> scenes_of(const BenchCollapseArguments& o) {
  std::vector<WatchedScene> scenes;
  for (const std::string& folder : o.scenes) scenes.push_back(scene_in(folder));
  if (scenes.empty()) scenes.push_back({bench_split("", "train", o.quick), bench_split("", "val", o.quick)});
  return scenes;
}

Json row_of(const bench::WatchedTraining& w, Context& context) {
  char noticed[40] = "not noticed";
  if (!w.said.empty()) std::snprintf(noticed, sizeof noticed, "noticed after %.1f s", w.noticed_after);
  print_line(context, "%-10s %-42s %6ld steps  %-22s explained %8.3f%s\n", w.scene.c_str(), w.what.c_str(),
             static_cast<long>(w.steps), noticed, w.explained, w.missed() ? "  MISSED" : "");
  return {{"scene", w.scene}, {"what", w.what},
          {"steps", w.steps}, {"noticed_after", number(w.noticed_after)},
          {"said", w.said},   {"explained", number(w.explained)}};
}

// Runs every fault on every scene.
Json provoked(const BenchCollapseArguments& o, const std::vector<WatchedScene>& scenes, Context& context) {
  Json rows = Json::array();
  Index noticed = 0, in_time = 0, missed = 0;
  double slowest = 0;
  auto faults = bench::training_faults();
  if (o.quick) faults.erase(faults.begin(), faults.end() - 2);
  const auto total = static_cast<double>(faults.size() * scenes.size());
  with_progress(context, [&](const auto& progress) {
    for (const WatchedScene& scene : scenes)
      for (const auto& fault : faults) {
        progress(fault.name, static_cast<double>(rows.size()) / total);
        const auto w =
            bench::watch_fault(scene.train, scene.judge, fault, o.healthy, o.patience, context.seed());
        noticed += !w.said.empty();
        in_time += w.noticed_after >= 0 && w.noticed_after <= kBar;
        missed += w.missed();
        if (!w.said.empty()) slowest = std::max(slowest, w.noticed_after);
        rows.push_back(row_of(w, context));
      }
  });
  return {{"cases", rows.size()},
          {"noticed", noticed},
          {"within_10_s", in_time},
          {"slowest", slowest},
          {"recovered", static_cast<Index>(rows.size()) - noticed - missed},
          {"missed", missed},
          {"rows", rows}};
}

// Runs settings that people choose, scene after scene; each round of all has the next seed.
Json ordinary(const BenchCollapseArguments& o, const std::vector<WatchedScene>& scenes, Context& context) {
  Json rows = Json::array();
  Index alarms = 0;
  double least = 1;
  with_progress(context, [&](const auto& progress) {
    for (std::uint64_t round = 0; std::ssize(rows) < o.ordinary; ++round)
      for (const auto& training : bench::ordinary_trainings(o.seconds, context.seed() + round))
        for (const WatchedScene& scene : scenes) {
          const bool unbounded_mlp = training.field.field.kind == nerf::FieldKind::mlp &&
                                     scene.train.scene == nerf::SceneType::place;
          if (unbounded_mlp || std::ssize(rows) == o.ordinary) continue;
          progress(training.name, static_cast<double>(rows.size()) / static_cast<double>(o.ordinary));
          const auto w = bench::watch_ordinary(scene.train, scene.judge, training);
          alarms += !w.said.empty();
          least = std::min(least, w.explained);
          rows.push_back(row_of(w, context));
        }
  });
  return {{"runs", rows.size()},
          {"false_alarms", alarms},
          {"least_explained", number(least)},
          {"seconds_each", o.seconds},
          {"rows", rows}};
}

int run_bench_collapse(const BenchCollapseArguments& o, Context& context) {
  const std::vector<WatchedScene> scenes = scenes_of(o);
  const Json faults = provoked(o, scenes, context), healthy = ordinary(o, scenes, context);
  context.result({{"healthy_seconds", o.healthy},
                  {"patience", o.patience},
                  {"provoked", faults},
                  {"ordinary", healthy}});
  return kOk;
}

}  // namespace

Command add_bench_collapse(CommandLine& app) {
  auto o = std::make_shared<BenchCollapseArguments>();
  app.add_option("--scene", o->scenes, "Data set to train on; repeatable")
      ->type_name("DIR")
      ->default_str("lego of FIELDMARK_DATA, else the built-in scene");
  add_number(app, "--ordinary", o->ordinary, 0, 10000, "Healthy trainings, 0 to 10000");
  add_number(app, "--seconds", o->seconds, 0.1, 86400,
             "Length of each healthy training in seconds, 0.1 to 86400", "S");
  add_number(app, "--healthy", o->healthy, 0, 86400,
             "Training time before a fault strikes in seconds, 0 to 86400", "S");
  add_number(app, "--patience", o->patience, 0.1, 86400,
             "Time after a fault at which a training ends unnoticed in seconds, 0.1 to 86400", "S");
  app.add_flag("--quick", o->quick, "Measure two faults on a small built-in scene");
  return [o](Context& context) { return run_bench_collapse(*o, context); };
}

}  // namespace fieldmark::cli
