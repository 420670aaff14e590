#include <fieldmark/engine/isa.h>
#include <fieldmark/tools/bench/engine_bench.h>
#include <fieldmark/tools/bench/precision_bench.h>
#include <fieldmark/tools/results/charts.h>

#include <cmath>
#include <optional>

#include "cli/bench.h"
#include "cli/shared_data.h"

namespace fieldmark::cli {
namespace {

struct BenchEngineArguments {
  std::string scene, plot, peer;
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
           {"gigabytes_per_second", where(r.gigabytes)},
           {"ratio_to_memory", where(r.ratio_to_memory)},
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
  row["gradient_difference"] = r.peer ? where(found.gradient_difference) : Json(nullptr);
  row["kink_difference"] = r.peer ? where(found.kink_difference) : Json(nullptr);
  return row;
}

// The settings that the peers' figures depend on; the same for all rows.
Json peer_json(const bench::EngineBench& result, const BenchEngineArguments& options) {
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

void print_row(Context& context, const bench::EngineRow& r, const Json& json) {
  char error[16] = "      -";  // a training step has no reference
  if (r.error > 0) std::snprintf(error, sizeof error, "%.1e", r.error);
  print_line(context, "%-26s %-32s spread %2.0f%%  error %s  %5.0f MB\n", r.name.c_str(),
             results::engine_speed(json).c_str(), 100 * r.spread, error, r.megabytes);
  if (r.peer)
    print_line(context,
               "  PyTorch %.4g s (%s), ours %.4g s: ratio %.2f; values differ %.1e, gradients %.1e\n",
               r.peer->seconds, r.peer->found.variant.c_str(), r.seconds, r.peer->ratio,
               r.peer->found.value_difference,
               r.peer->found.gradient_difference > 0 ? r.peer->found.gradient_difference
                                                     : r.peer->found.kink_difference);
}

struct Scene {
  std::optional<nerf::Dataset> train, test;  // both empty: the built-in scene
};

// Loads the data set of --scene, else lego if FIELDMARK_DATA has it; read only for rows that train.
Scene scene_of(const BenchEngineArguments& options) {
  const std::filesystem::path folder =
      options.scene.empty() ? shared_data("nerf_synthetic/lego") : std::filesystem::path(options.scene);
  Scene scene;
  const bool step = std::string("nerf_step_first").find(options.engine.only) != std::string::npos;
  if (!options.scene.empty() && !(step || options.precision))
    throw UsageError("--scene: no row that --only selects trains on a scene");
  if (folder.empty() || !(step || options.precision)) return scene;
  scene.train = nerf::load_dataset(folder);
  if (options.precision) scene.test = nerf::load_dataset(folder, {.split = "test"});
  return scene;
}

// Ctrl-C ends a peer too; its failure then counts as an interruption.
bench::EngineBench measured(const BenchEngineArguments& options, Context& context) {
  const InterruptGuard guard;
  try {
    return read_option("options", [&] {
      return with_progress(
          context, [&](const auto& progress) { return bench::run_engine_bench(options.engine, progress); });
    });
  } catch (const Error&) {
    if (guard.interrupted()) throw Interrupted("nothing was written");
    throw;
  }
}

// Prints one digit more than is certain; "inf" is not valid JSON.
Json precision_json(const bench::PrecisionRow& r) {
  return {{"work", r.work},
          {"variant", r.variant},
          {"seconds", r.seconds},
          {"speedup", r.speedup},
          {"error", std::isfinite(r.error) ? Json(r.error) : Json(nullptr)},
          {"measure", r.measure}};
}

Json precision(const BenchEngineArguments& options, const Scene& scene, Context& context) {
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
    print_line(context, "%-48s %-40s %10.4f s  %6.2f x  %10.3g %s\n", r.work.c_str(), r.variant.c_str(),
               r.seconds, r.speedup, r.error, r.measure.c_str());
    json.push_back(precision_json(r));
  }
  return json;
}

int run_bench_engine(BenchEngineArguments options, Context& context) {
  if (!options.plot.empty()) check_writable_page(options.plot);
  const Scene scene = scene_of(options);
  if (scene.train) options.engine.scene = &*scene.train;
  if (!options.peer.empty()) options.engine.peer = options.python;
  const bench::EngineBench result = measured(options, context);
  print_line(context, "peak %.1f GFLOP/s (fp32 multiply-add, kernels %s)\n", result.peak_gflops, isa_name());
  Json rows = Json::array();
  for (const auto& row : result.rows) {
    rows.push_back(row_json(row, !options.peer.empty()));
    print_row(context, row, rows.back());
  }
  Json json{{"peak_gflops", result.peak_gflops}, {"isa", isa_name()}};
  if (!options.peer.empty()) json["peer"] = peer_json(result, options);
  json["rows"] = rows;
  if (!options.plot.empty()) results::write_charts("engine", options.plot, json);
  if (options.precision) json["precision"] = precision(options, scene, context);
  context.result(json);
  return kOk;
}

}  // namespace

Command add_bench_engine(CommandLine& app) {
  auto o = std::make_shared<BenchEngineArguments>();
  add_number(app, "--runs", o->engine.runs, 1, 1000, "Runs of each row, 1 to 1000; their median counts");
  add_number(app, "--scale", o->engine.scale, 1e-6, 1,
             "Factor on the number of samples of each row, above 0 to 1", "F");
  add_file(app, "--only", o->engine.only, "Rows whose names contain TEXT; default: all", "TEXT");
  add_scene_option(app, o->scene);
  app.add_flag("--precision", o->precision,
               "Measure speed against error of double, float, bf16 and of each approximation as well");
  add_plot(app, o->plot);
  auto peer =
      add_file(app, "--peer", o->peer,
               "Peer to compare speed and gradients with, timed alternately: pytorch; default: none", "NAME")
          ->one_of({"pytorch"});
  app.add_option("--python", o->python.python, "Python interpreter that has torch; for --peer")
      ->type_name("FILE")
      ->needs(peer);
  add_number(app, "--peer-limit", o->python.limit_seconds, 0.1, 86400,
             "Time limit for each answer of the peer in seconds, 0.1 to 86400", "S")
      ->needs(peer);
  return [o](Context& context) { return run_bench_engine(*o, context); };
}

}  // namespace fieldmark::cli
