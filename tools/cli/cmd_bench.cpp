#include <fieldmark/core/files.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/imaging/bar_chart.h>
#include <fieldmark/tools/bench/engine_bench.h>
#include <fieldmark/tools/bench/precision_bench.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>

#include "cli/bench_attacks.h"
#include "cli/bench_embed.h"
#include "cli/bench_field.h"
#include "cli/bench_payload.h"
#include "cli/bench_training.h"
#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"

namespace fieldmark::cli {
namespace {

struct Options {
  std::string what, peer;
  BenchAttacksOptions attacks;
  BenchEmbedOptions embed;
  BenchFieldOptions field;  // and what both have: --scene, --plot, --runs
  BenchPayloadOptions payload;
  bool precision = false;
  bench::PeerOptions python;
  bench::EngineBenchOptions engine;
};

Json row_json(const bench::EngineRow& r, bool with_peer) {
  const auto where = [](double value) { return value > 0 ? Json(value) : Json(nullptr); };
  Json row{{"name", r.name},
           {"what", r.what},
           {"seconds", r.seconds},
           {"spread", r.spread},
           {"gflops", where(r.gflops)},
           {"ratio_to_peak", where(r.ratio_to_peak)},
           {"items_per_second", r.rate},
           {"ratio_to_scalar", where(r.speedup)},
           {"error", where(r.error)},
           {"peak_megabytes", r.megabytes},
           {"peer_ratio", r.peer ? Json(r.peer->ratio) : Json(nullptr)}};
  if (!with_peer) return row;
  const bench::PeerRow peer = r.peer.value_or(bench::PeerRow{});
  const bench::Peer::Found& found = peer.found;
  const auto of_peer = [&](const auto& value) { return r.peer ? Json(value) : Json(nullptr); };
  row["peer_ratio_at_peak"] =
      r.peer && r.ratio_to_peak > 0 ? Json(peer.ratio / r.ratio_to_peak) : Json(nullptr);
  row["peer_seconds"] = of_peer(peer.seconds);
  row["peer_untuned_seconds"] = of_peer(found.untuned_seconds);
  row["peer_variant"] = of_peer(found.variant);
  row["peer_environment"] = of_peer(found.tuned ? "tuned" : "as it is");
  row["value_difference"] = of_peer(found.value_difference);
  row["gradient_difference"] = of_peer(found.gradient_difference);
  row["kink_difference"] = r.peer ? where(found.kink_difference) : Json(nullptr);
  return row;
}

// What the peers' figures depend on; the same for all rows.
Json peer_json(const bench::EngineBench& result, const Options& options) {
  for (const auto& row : result.rows)
    if (row.peer) {
      const bench::Peer::Found& found = row.peer->found;
      return {{"name", options.peer},
              {"version", found.version},
              {"python", options.python.python},
              {"threads", found.threads},
              {"blas", found.blas},
              {"cpu_capability", found.cpu_capability},
              {"tuned_environment", bench::Peer::tuned_environment()},
              {"ratio", "seconds of its fastest variant over ours, median of runs by turns"}};
    }
  return nullptr;
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
  char error[16] = "      -";  // a training step is compared with nothing
  if (r.error > 0) std::snprintf(error, sizeof error, "%.1e", r.error);
  std::snprintf(line, sizeof line, "%-26s %-32s spread %2.0f%%  error %s  %5.0f MB\n", r.name.c_str(),
                speed_of(r).c_str(), 100 * r.spread, error, r.megabytes);
  out << line;
  if (!r.peer) return;
  std::snprintf(line, sizeof line,
                "  PyTorch %.4g s (%s), ours %.4g s: ratio %.2f; values differ %.1e, gradients %.1e\n",
                r.peer->seconds, r.peer->found.variant.c_str(), r.seconds, r.peer->ratio,
                r.peer->found.value_difference, r.peer->found.gradient_difference);
  out << line;
}

// Bars are parts of the peak; look-ups and steps, which have none, show their notes alone.
void write_plot(const std::string& path, const bench::EngineBench& result) {
  std::vector<bench::Bar> bars;
  for (const auto& r : result.rows) {
    bars.push_back({r.name, r.ratio_to_peak, speed_of(r)});
    if (!r.peer) continue;
    char note[40];
    std::snprintf(note, sizeof note, "PyTorch, %.2f x our time", r.peer->ratio);
    bars.push_back({"PyTorch", r.ratio_to_peak / r.peer->ratio, note});
  }
  char title[80];
  std::snprintf(title, sizeof title, "Part of the peak of %.0f GFLOP/s, kernels %s", result.peak_gflops,
                isa_name());
  // Winograd's convolution does with fewer operations what it is credited for, so its bar may pass the peak.
  double longest = 1;
  for (const auto& bar : bars) longest = std::max(longest, bar.value);
  write_file_atomically(path, bench::bar_chart(title, bars, std::ceil(longest)));
}

struct Scene {
  std::optional<nerf::Dataset> train, test;  // none: the built-in scene
};

// The data set of --scene, or else lego where FIELDMARK_DATA has it.
Scene scene_of(const Options& options) {
  const std::filesystem::path folder = options.field.scene.empty() ? lego_folder() : options.field.scene;
  Scene scene;
  const bool step = std::string("nerf_step_first").find(options.engine.only) != std::string::npos;
  if (folder.empty() || !(step || options.precision)) return scene;
  scene.train = nerf::load_dataset(folder);
  if (options.precision) scene.test = nerf::load_dataset(folder, {.split = "test"});
  return scene;
}

bench::EngineBench measured(const Options& options, Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("bench");
  const auto stop_if_asked = [&] {
    if (guard.interrupted()) throw Interrupted("nothing was written");
  };
  bench::EngineBenchOptions engine = options.engine;
  if (!options.peer.empty()) engine.peer = options.python;
  try {
    return read_option("bench engine", [&] {
      return bench::run_engine_bench(engine, [&](const std::string& name, double part) {
        stop_if_asked();
        progress.update(part, name);
      });
    });
  } catch (const Error&) {  // Ctrl-C ends a peer too
    stop_if_asked();
    throw;
  }
}

// One digit more than is sure; "inf" is no JSON.
Json precision_json(const bench::PrecisionRow& r) {
  return {{"work", r.work},
          {"variant", r.variant},
          {"seconds", r.seconds},
          {"speedup", r.speedup},
          {"error", std::isfinite(r.error) ? Json(r.error) : Json(nullptr)},
          {"measure", r.measure}};
}

Json precision(const Options& options, const Scene& scene, Context& context) {
  Progress progress = context.progress("precision");
  double part = 0;
  const auto rows = bench::run_precision_bench({.runs = options.engine.runs,
                                                .scale = options.engine.scale,
                                                .train = scene.train ? &*scene.train : nullptr,
                                                .test = scene.test ? &*scene.test : nullptr},
                                               [&](const std::string& name) {
                                                 progress.update(part, name);
                                                 part += 0.25;
                                               });
  Json json = Json::array();
  for (const auto& r : rows) {
    char line[240];
    std::snprintf(line, sizeof line, "%-48s %-40s %10.4f s  %6.2f x  %10.3g %s\n", r.work.c_str(),
                  r.variant.c_str(), r.seconds, r.speedup, r.error, r.measure.c_str());
    context.text() << line;
    json.push_back(precision_json(r));
  }
  return json;
}

int run(Options options, Context& context) {
  if (options.what == "field") return bench_field(options.field, context);
  if (options.what == "training") return bench_training(options.field, context);
  if (options.what == "payload") return bench_payload(options.payload, context);
  if (options.what == "attacks") {
    options.attacks.field = options.field.field;
    options.attacks.plot = options.field.plot;
    options.attacks.quick = options.field.quick;
    return bench_attacks(options.attacks, context);
  }
  if (options.what == "embed") {
    const BenchFieldOptions& shared = options.field;
    options.embed.owner = options.attacks.owner;
    options.embed.field = shared.field;
    options.embed.scene = shared.scene;
    options.embed.plot = shared.plot;
    options.embed.only = options.engine.only;
    options.embed.quick = shared.quick;
    return bench_embed(options.embed, context);
  }
  options.engine.runs = options.field.runs;
  if (!options.field.plot.empty()) check_writable(options.field.plot);
  const Scene scene = scene_of(options);
  if (scene.train) options.engine.scene = &*scene.train;
  const bench::EngineBench result = measured(options, context);
  char line[80];
  std::snprintf(line, sizeof line, "peak %.1f GFLOP/s (fp32 multiply-add, kernels %s)\n", result.peak_gflops,
                isa_name());
  context.text() << line;
  Json rows = Json::array();
  for (const auto& row : result.rows) {
    print_row(context.text(), row);
    rows.push_back(row_json(row, !options.peer.empty()));
  }
  if (!options.field.plot.empty()) write_plot(options.field.plot, result);
  Json json{{"peak_gflops", result.peak_gflops}, {"isa", isa_name()}};
  if (!options.peer.empty()) json["peer"] = peer_json(result, options);
  json["rows"] = rows;
  if (options.precision) json["precision"] = precision(options, scene, context);
  context.result(json);
  return kOk;
}

}  // namespace

Command add_bench(CommandLine& app) {
  auto o = std::make_shared<Options>();
  app.add_option("what", o->what,
                 "engine: kernels and training steps, against this machine's peak;\n"
                 "field: rendering in many ways, speed against error;\n"
                 "training: every choice of training switched off and on, for --seconds each;\n"
                 "embed: embedding in many ways, for --seconds each: what is read, and at which strength;\n"
                 "payload: how often payloads are exact at rates of wrong bits, and how often noise is one;\n"
                 "attacks: a baked mark under attacks on its images and its file, accuracy against damage")
      ->required()
      ->one_of({"engine", "field", "training", "embed", "payload", "attacks"})
      ->type_name("WHAT");
  app.add_option("--runs", o->field.runs, "Runs of each row, whose median counts, 1 to 1000")
      ->range(1, 1000)
      ->type_name("N");
  app.add_option("--scale", o->engine.scale,
                 "engine: of the numbers of samples, above 0 to 1: smaller is quicker and less exact")
      ->range(1e-6, 1.0)
      ->type_name("F");
  app.add_option("--only", o->engine.only, "engine, embed: only rows with TEXT in their name")
      ->type_name("TEXT")
      ->default_str("all");
  app.add_option("--rows", o->embed.rows,
                 "embed: keeps rows in FILE as they are measured; those in FILE are not measured again, and "
                 "shown whatever --only says (none)")
      ->type_name("FILE")
      ->default_str("");
  app.add_option("--scene", o->field.scene,
                 "Data set that nerf_step, --precision, field, training and embed train on, whose test views "
                 "field renders, "
                 "and whose val views judge training")
      ->type_name("DIR")
      ->default_str("lego of FIELDMARK_DATA, else the built-in scene");
  app.add_flag(
      "--precision", o->precision,
      "engine: also a table of speed against error: double, float, bf16, and every approximation in use");
  app.add_option("--plot", o->field.plot, "SVG image of the rows (none)")->type_name("FILE")->default_str("");
  const Option peer =
      app.add_option("--peer", o->peer,
                     "engine: pytorch: ratio to PyTorch on the rows it can do, timed by turns, "
                     "gradients compared (none)")
          ->one_of({"pytorch"})
          ->type_name("NAME")
          ->default_str("");
  app.add_option("--python", o->python.python, "Interpreter with torch, for --peer")
      ->type_name("FILE")
      ->needs(peer);
  app.add_option("--peer-limit", o->python.limit_seconds, "Of each answer of the peer, seconds, 0.1 to 86400")
      ->range(0.1, 86400.0)
      ->type_name("S")
      ->needs(peer);
  add_bench_field(app, o->field);
  add_bench_payload(app, o->payload);
  add_bench_attacks(app, o->attacks);
  const Option size = app.option("--size"), views = app.option("--views"), bits = app.option("--bits"),
               seconds = app.option("--seconds");
  return [o, size, views, bits, seconds](Context& context) {
    if (size->count() > 0) o->attacks.size = o->embed.size = o->field.size;
    if (views->count() > 0) o->embed.views = o->field.views;
    if (bits->count() > 0) o->embed.bits = o->payload.bits;
    if (seconds->count() > 0) o->embed.seconds = o->field.seconds;
    return run(*o, context);
  };
}

}  // namespace fieldmark::cli
