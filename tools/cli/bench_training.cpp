#include "cli/bench_training.h"

#include <fieldmark/engine/isa.h>
#include <fieldmark/tools/bench/training_bench.h>

#include <cstdio>
#include <ostream>

#include "cli/cli.h"
#include "cli/context.h"
#include "cli/long_run.h"

namespace fieldmark::cli {
namespace {

void print_row(std::ostream& out, const bench::TrainingRow& r, double default_psnr) {
  char line[240];
  std::snprintf(line, sizeof line,
                "%-16s %-56s %6.2f dB  %+5.2f  %6ld steps  %6.1f M samples  %5.1f s  view %.3f s\n",
                r.variant.choice.c_str(), r.variant.setting.c_str(), r.psnr, r.psnr - default_psnr,
                static_cast<long>(r.steps), r.samples * 1e-6, r.seconds, r.seconds_per_view);
  out << line;
}

Json row_json(const bench::TrainingRow& r, double default_psnr) {
  return {{"choice", r.variant.choice},
          {"setting", r.variant.setting},
          {"psnr", r.psnr},
          {"difference", r.psnr - default_psnr},
          {"steps", r.steps},
          {"samples", r.samples},
          {"seconds", r.seconds},
          {"seconds_per_view", r.seconds_per_view}};
}

}  // namespace

int bench_training(const BenchFieldOptions& options, Context& context) {
  const std::string folder = options.scene.empty() ? lego_folder() : options.scene;
  const nerf::Dataset train = bench_split(folder, "train", options.quick),
                      judge = bench_split(folder, "val", options.quick);
  auto variants = bench::training_variants({.seconds = options.seconds}, context.seed());
  if (options.quick) variants.resize(3);
  const InterruptGuard guard;
  std::vector<bench::TrainingRow> rows;
  {
    Progress progress = context.progress("bench");
    rows = bench::run_training_bench(train, judge, variants, [&](const std::string& name, double part) {
      if (guard.interrupted()) throw Interrupted("nothing was written");
      progress.update(part, name);
    });
  }
  Json list = Json::array();
  for (const bench::TrainingRow& row : rows) {
    print_row(context.text(), row, rows.front().psnr);
    list.push_back(row_json(row, rows.front().psnr));
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

}  // namespace fieldmark::cli
