#include <fieldmark/engine/isa.h>
#include <fieldmark/tools/bench/training_bench.h>

#include "cli/bench.h"

namespace fieldmark::cli {
namespace {

struct BenchTrainingArguments {
  std::string scene;
  double seconds = 60;
  bool quick = false;
};

int run_bench_training(const BenchTrainingArguments& options, Context& context) {
  const nerf::Dataset train = bench_split(options.scene, "train", options.quick),
                      judge = bench_split(options.scene, "val", options.quick);
  auto variants = bench::training_variants({.seconds = options.seconds}, context.seed());
  if (options.quick) variants.resize(3);
  const auto rows = with_progress(context, [&](const auto& progress) {
    return bench::run_training_bench(train, judge, variants, progress);
  });
  Json list = Json::array();
  for (const bench::TrainingRow& r : rows) {
    const double difference = r.psnr - rows.front().psnr;
    print_line(context, "%-16s %-56s %6.2f dB  %+5.2f  %6ld steps  %6.1f M samples  %5.1f s  view %.3f s\n",
               r.variant.choice.c_str(), r.variant.setting.c_str(), r.psnr, difference,
               static_cast<long>(r.steps), r.samples * 1e-6, r.seconds, r.seconds_per_view);
    list.push_back({{"choice", r.variant.choice},
                    {"setting", r.variant.setting},
                    {"psnr", r.psnr},
                    {"difference", difference},
                    {"steps", r.steps},
                    {"samples", r.samples},
                    {"seconds", r.seconds},
                    {"seconds_per_view", r.seconds_per_view}});
  }
  context.result({{"scene", train.name},
                  {"split", "val"},
                  {"views", judge.views.size()},
                  {"width", judge.views.front().camera.width},
                  {"height", judge.views.front().camera.height},
                  {"isa", isa_name()},
                  {"seconds_each", options.seconds},
                  {"rows", list}});
  return kOk;
}

}  // namespace

Command add_bench_training(CommandLine& app) {
  auto o = std::make_shared<BenchTrainingArguments>();
  add_scene_option(app, o->scene);
  add_number(app, "--seconds", o->seconds, 0.1, 86400, "Training time of each row in seconds, 0.1 to 86400",
             "S");
  app.add_flag("--quick", o->quick, "Measure three rows; without a data set, on a small built-in scene");
  return [o](Context& context) { return run_bench_training(*o, context); };
}

}  // namespace fieldmark::cli
