#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/collapse_watch.h>
#include <fieldmark/tools/bench/collapse_bench.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "cli/bench.h"

namespace fieldmark::cli {
namespace {

constexpr double kBar = 10;      // seconds within which a collapse should be noticed
constexpr Index kQuickRuns = 2;  // ordinary trainings

struct BenchCollapseArguments {
  std::vector<std::string> scenes;
  double seconds = 30, fault_after = 5, patience = 15;
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

// Counts of the rows of a part.
struct Counts {
  Index noticed = 0, in_time = 0, early = 0, missed = 0, false_alarms = 0;
  double slowest = std::numeric_limits<double>::quiet_NaN();         // NaN: nothing was noticed
  double least_explained = std::numeric_limits<double>::infinity();  // NaN if one is

  void add(const bench::WatchedTraining& w) {
    const bool alarm = !w.said.empty(), after = alarm && w.noticed_after >= 0;
    noticed += after, early += alarm && !after, missed += !alarm && w.collapsed();
    in_time += after && w.noticed_after <= kBar;
    false_alarms += alarm && !w.collapsed();
    if (after && !(w.noticed_after <= slowest)) slowest = w.noticed_after;
    if (!std::isnan(least_explained) && !(w.explained >= least_explained)) least_explained = w.explained;
  }
};

void print(const std::vector<bench::WatchedTraining>& rows, Context& context) {
  for (const auto& w : rows) {
    char alarm[40] = "no alarm";
    if (!w.said.empty()) std::snprintf(alarm, sizeof alarm, "alarm after %.1f s", w.noticed_after);
    print_line(context, "%-10s %-42s %6ld steps  %-20s explained %8.3f\n", w.scene.c_str(), w.what.c_str(),
               static_cast<long>(w.steps), alarm, w.explained);
  }
}

Json json_of(const std::vector<bench::WatchedTraining>& rows) {
  Json list = Json::array();
  for (const auto& w : rows)
    list.push_back({{"scene", w.scene},
                    {"what", w.what},
                    {"steps", w.steps},
                    {"noticed_after", number(w.noticed_after)},
                    {"said", w.said},
                    {"explained", number(w.explained)}});
  return list;
}

// Runs every fault on every scene.
std::vector<bench::WatchedTraining> provoked(const BenchCollapseArguments& o,
                                             const std::vector<WatchedScene>& scenes, Context& context) {
  std::vector<bench::WatchedTraining> rows;
  auto faults = bench::training_faults();
  if (o.quick) faults.erase(faults.begin(), faults.end() - 1);
  const auto total = static_cast<double>(faults.size() * scenes.size());
  with_progress(context, [&](const auto& progress) {
    for (const WatchedScene& scene : scenes)
      for (const auto& fault : faults)
        rows.push_back(
            bench::watch_fault(scene.train, scene.judge, fault,
                               {.after = o.fault_after, .patience = o.patience, .seed = context.seed()},
                               [&] { progress(fault.name, static_cast<double>(rows.size()) / total); }));
  });
  return rows;
}

// Runs ordinary trainings, each on every scene; each round of all has the next seed.
std::vector<bench::WatchedTraining> ordinary(const BenchCollapseArguments& o,
                                             const std::vector<WatchedScene>& scenes, Context& context) {
  std::vector<bench::WatchedTraining> rows;
  const Index runs = o.quick ? std::min<Index>(o.ordinary, kQuickRuns) : o.ordinary;
  with_progress(context, [&](const auto& progress) {
    for (std::uint64_t round = 0; std::ssize(rows) < runs; ++round)
      for (const auto& training : bench::ordinary_trainings({.seconds = o.seconds}, context.seed() + round))
        for (const WatchedScene& scene : scenes) {
          // An mlp field cannot have a scene without bounds.
          const bool unbounded_mlp = training.field.field.kind == nerf::FieldKind::mlp &&
                                     scene.train.scene == nerf::SceneType::place;
          if (unbounded_mlp || std::ssize(rows) == runs) continue;
          rows.push_back(bench::watch_ordinary(scene.train, scene.judge, training, [&] {
            progress(training.name(), static_cast<double>(rows.size()) / static_cast<double>(runs));
          }));
        }
  });
  return rows;
}

int run_bench_collapse(const BenchCollapseArguments& o, Context& context) {
  const std::vector<WatchedScene> scenes = scenes_of(o);
  const auto faults = provoked(o, scenes, context);
  print(faults, context);
  const auto runs = ordinary(o, scenes, context);
  print(runs, context);
  Counts of_faults, of_runs;
  for (const auto& w : faults) of_faults.add(w);
  for (const auto& w : runs) of_runs.add(w);
  const auto cases = std::ssize(faults);
  context.result({{"fault_after", o.fault_after},
                  {"patience", o.patience},
                  {"provoked",
                   {{"cases", cases},
                    {"noticed", of_faults.noticed},
                    {"within_10_s", of_faults.in_time},
                    {"slowest", number(of_faults.slowest)},
                    {"alarms_before", of_faults.early},
                    {"missed", of_faults.missed},
                    {"not_collapsed", cases - of_faults.noticed - of_faults.early - of_faults.missed}}},
                  {"ordinary",
                   {{"runs", std::ssize(runs)},
                    {"seconds_each", o.seconds},
                    {"false_alarms", of_runs.false_alarms},
                    {"right_alarms", of_runs.noticed - of_runs.false_alarms},
                    {"missed", of_runs.missed},
                    {"least_explained", number(of_runs.least_explained)}}},
                  {"faults", json_of(faults)},
                  {"runs", json_of(runs)}});
  return kOk;
}

}  // namespace

Command add_bench_collapse(CommandLine& app) {
  auto o = std::make_shared<BenchCollapseArguments>();
  app.add_option("--scene", o->scenes, "Data set to train on; repeatable")
      ->type_name("DIR")
      ->default_str("lego of FIELDMARK_DATA, else the built-in scene");
  add_number(app, "--ordinary", o->ordinary, 0, 10000, "Ordinary trainings, 0 to 10000");
  add_number(app, "--seconds", o->seconds, 0.1, 86400,
             "Length of each ordinary training in seconds, 0.1 to 86400", "S");
  add_number(app, "--fault-after", o->fault_after, 0, 86400,
             "Training time before a fault strikes in seconds, 0 to 86400", "S");
  add_number(app, "--patience", o->patience, 0.1, 86400,
             "Training time after a fault in seconds, 0.1 to 86400", "S");
  app.add_flag("--quick", o->quick,
               "Measure one fault and two ordinary trainings, on a small scene if no data set is found");
  return [o](Context& context) { return run_bench_collapse(*o, context); };
}

}  // namespace fieldmark::cli
