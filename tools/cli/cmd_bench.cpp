#include <fieldmark/bench/bar_chart.h>
#include <fieldmark/bench/engine_bench.h>
#include <fieldmark/engine/files.h>
#include <fieldmark/engine/isa.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"

namespace fieldmark::cli {
namespace {

struct Options {
  std::string what, plot;
  bench::EngineBenchOptions engine;
};

Json row_json(const bench::EngineRow& r) {
  const auto where = [](double value) { return value > 0 ? Json(value) : Json(nullptr); };
  return {{"name", r.name},
          {"what", r.what},
          {"seconds", r.seconds},
          {"spread", r.spread},
          {"gflops", where(r.gflops)},
          {"ratio_to_peak", where(r.ratio_to_peak)},
          {"items_per_second", r.rate},
          {"ratio_to_scalar", where(r.speedup)},
          {"error", where(r.error)},
          {"peak_megabytes", r.megabytes},
          {"peer_ratio", nullptr}};
}

// How fast a row is, in the unit of its kind.
std::string speed_of(const bench::EngineRow& r) {
  char text[80];
  if (r.gflops > 0)
    std::snprintf(text, sizeof text, "%.2f of peak, %.1f GFLOP/s", r.ratio_to_peak, r.gflops);
  else if (r.speedup > 0)
    std::snprintf(text, sizeof text, "%.1f ns a point, %.2f x scalar", 1e9 / r.rate, r.speedup);
  else
    std::snprintf(text, sizeof text, "%.3f million samples/s", r.rate * 1e-6);
  return text;
}

void print_row(std::ostream& out, const bench::EngineRow& r) {
  char line[200];
  std::snprintf(line, sizeof line, "%-26s %-32s spread %2.0f%%  error %.1e  %5.0f MB\n", r.name.c_str(),
                speed_of(r).c_str(), 100 * r.spread, r.error, r.megabytes);
  out << line;
}

// Bars are parts of the peak; look-ups and steps, which have none, show their notes alone.
void write_plot(const std::string& path, const bench::EngineBench& result) {
  std::vector<bench::Bar> bars;
  for (const auto& r : result.rows) bars.push_back({r.name, r.ratio_to_peak, speed_of(r)});
  char title[80];
  std::snprintf(title, sizeof title, "Part of the peak of %.0f GFLOP/s, kernels %s", result.peak_gflops,
                isa_name());
  write_file_atomically(path, bench::bar_chart(title, bars, 1));
}

int run(const Options& options, Context& context) {
  if (!options.plot.empty()) check_writable(options.plot);
  Progress progress = context.progress("bench");
  const auto result = read_option("bench engine", [&] {
    return bench::run_engine_bench(
        options.engine, [&](const std::string& name, double part) { progress.update(part, name); });
  });
  char line[80];
  std::snprintf(line, sizeof line, "peak %.1f GFLOP/s (fp32 multiply-add, kernels %s)\n", result.peak_gflops,
                isa_name());
  context.text() << line;
  Json rows = Json::array();
  for (const auto& row : result.rows) {
    print_row(context.text(), row);
    rows.push_back(row_json(row));
  }
  if (!options.plot.empty()) write_plot(options.plot, result);
  context.result({{"peak_gflops", result.peak_gflops}, {"isa", isa_name()}, {"rows", rows}});
  return kOk;
}

}  // namespace

Command add_bench(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("what", o->what, "engine: kernels and training steps, against this machine's peak")
      ->required()
      ->check(CLI::IsMember({"engine"}).description(""))
      ->type_name("WHAT");
  app.add_option("--runs", o->engine.runs, "Runs of each row, whose median counts, 1 to 1000")
      ->check(CLI::Range(1, 1000).description(""))
      ->type_name("N");
  app.add_option("--scale", o->engine.scale,
                 "Of the numbers of samples, above 0 to 1: smaller is quicker and less exact")
      ->check(CLI::Range(1e-6, 1.0).description(""))
      ->type_name("F");
  app.add_option("--only", o->engine.only, "Only rows with TEXT in their name")
      ->type_name("TEXT")
      ->default_str("all");
  app.add_option("--plot", o->plot, "SVG picture of the rows (none)")->type_name("FILE")->default_str("");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
