#include "cli/bench_field.h"

#include <fieldmark/core/files.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/imaging/scatter_chart.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/trainer.h>
#include <fieldmark/tools/bench/field_bench.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>

#include "cli/cli.h"
#include "cli/context.h"
#include "cli/long_run.h"
#include "cli/scene_data.h"

namespace fieldmark::cli {
namespace {

constexpr Index kSceneSize = 200, kSceneViews = 50;  // of the built-in scene

struct Subject {
  std::unique_ptr<nerf::RadianceField> field;
  std::vector<nerf::Camera> cameras;
  std::string name;
};

// Views spread evenly over the test split; without a data set, drawn around the training cameras.
Subject subject_of(const BenchFieldOptions& options, Context& context) {
  Subject subject;
  const bool stored = !options.field.empty();
  const std::string folder = stored || !options.scene.empty() ? options.scene : lego_folder();
  if (stored) {
    subject.field = std::make_unique<nerf::RadianceField>(nerf::RadianceField::load(options.field));
    subject.name = std::filesystem::path(options.field).filename().string();
    if (folder.empty()) {
      subject.cameras = nerf::make_cameras(subject.field->cameras, nerf::CameraSet::novel, options.views,
                                           options.size, context.seed());
      return subject;
    }
  }
  const nerf::Dataset test = bench_split(folder, "test", options.quick);
  const auto all = static_cast<Index>(test.views.size()), count = std::min(options.views, all);
  for (Index i = 0; i < count; ++i)
    subject.cameras.push_back(
        test.views[static_cast<std::size_t>(i * all / count)].camera.scaled(options.size));
  if (!stored) {
    const nerf::Dataset data = bench_split(folder, "train", options.quick);
    subject.field = trained_field(data, options.seconds, context);
    subject.name = data.name;
  }
  return subject;
}

Json row_json(const bench::FieldRow& r) {
  return {{"knob", r.variant.knob},         {"setting", r.variant.setting},
          {"seconds", r.seconds},           {"spread", r.spread},
          {"psnr", number(r.psnr)},         {"max_error", r.max_error},
          {"dropped_mean", r.dropped_mean}, {"dropped_max", r.dropped_max},
          {"grid_kb", r.grid_bytes / 1000}, {"front", r.front}};
}

void print_row(std::ostream& out, const bench::FieldRow& r) {
  char line[240];
  std::snprintf(line, sizeof line,
                "%c %-12s %-48s %7.4f s  %6.2f dB  max %.3f  dropped %.1e, at most %.3f  spread %2.0f%%\n",
                r.front ? '*' : ' ', r.variant.knob.c_str(), r.variant.setting.c_str(), r.seconds, r.psnr,
                r.max_error, r.dropped_mean, r.dropped_max, 100 * r.spread);
  out << line;
}

void write_plot(const std::string& path, const Subject& subject, const bench::FieldBench& result) {
  // Of what can be seen in the plot, without a margin: a line that rises.
  std::vector<bench::SpeedQuality> seen;
  for (const bench::FieldRow& r : result.rows) seen.push_back({r.seconds, r.psnr});
  const std::vector<bool> line = bench::pareto_front(seen, {.time = 0, .psnr = 0});
  std::vector<bench::ScatterPoint> points;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bench::FieldRow& r = result.rows[i];
    points.push_back({.x = r.seconds,
                      .y = r.psnr,
                      .series = r.variant.knob,
                      .label = line[i] && i > 0 ? r.variant.setting : "",
                      .line = line[i],
                      .ring = i == 0});
  }
  write_file_atomically(path,
                        bench::scatter_chart({.title = "Rendering " + subject.name + ": speed against error",
                                              .x = "seconds a view (nothing is faster and more exact than "
                                                   "the dashed line; the ring is the default)",
                                              .y = "PSNR against the reference, dB"},
                                             points));
}

Json occupancy_json(const bench::OccupancyCost& cost) {
  return {{"pixels", cost.pixels},
          {"psnr", number(cost.psnr)},
          {"max_error", cost.max_error},
          {"dropped_mean", cost.dropped_mean},
          {"dropped_max", cost.dropped_max}};
}

constexpr const char* kReference =
    "rays, look-ups, networks and composite in double; samples spread evenly over each ray's way through the "
    "cube; no early stop; matter where the field's grid has occupied cells, as the FIELD file says";
constexpr const char* kOccupancy =
    "what the grid rules out: the reference with it against the reference without, on pixels drawn at "
    "random; "
    "outside the silhouettes a field was never trained, so this is no loss where the grid follows them";

}  // namespace

std::unique_ptr<nerf::RadianceField> trained_field(const nerf::Dataset& data, double seconds,
                                                   Context& context) {
  nerf::RadianceFieldOptions sizes = nerf::field_options({.seconds = seconds});
  sizes.seed = context.seed();
  auto field = std::make_unique<nerf::RadianceField>(sizes);
  const double begin = context.seconds();
  nerf::Trainer trainer(*field, data, {.schedule = {.seconds = seconds}, .seed = context.seed()});
  run_long({.what = "train",
            .done = [&] { return trainer.done(); },
            .step = [&](double now) { trainer.step(now - begin); },
            .steps = [&] { return trainer.steps(); },
            .note = [] { return std::string(); },
            .save = {},
            .checkpoint = {}},
           {.steps = 0, .seconds = seconds}, context);
  return field;
}

nerf::Dataset bench_split(const std::string& folder, const std::string& split, bool quick) {
  if (!folder.empty()) return nerf::load_dataset(folder, {.split = split});
  const Index part = quick ? 8 : 1;
  return nerf::make_scene({.size = kSceneSize / part, .views = kSceneViews / part}, split);
}

std::string lego_folder() { return shared_data("nerf_synthetic/lego").string(); }

void add_bench_field(CommandLine& app, BenchFieldOptions& o) {
  app.add_option(
         "--field", o.field,
         "field: what is rendered (trained for --seconds); embed: what is marked (trained for a minute); "
         "attacks: the baked field")
      ->type_name("FIELD")
      ->default_str("");
  app.add_option("--size", o.size,
                 "field, embed and attacks (as trained): pixels of the views' longer side, 16 to 8192")
      ->range(16, 8192)
      ->type_name("N");
  app.add_option("--views", o.views, "field: how many; embed: to judge by (24); 1 to 1000")
      ->range(1, 1000)
      ->type_name("N");
  app.add_option("--seconds", o.seconds,
                 "field: of training, without --field; training, embed: of each; 0.1 to 86400")
      ->range(0.1, 86400.0)
      ->type_name("S")
      ->default_str("60; embed 90");
  app.add_flag("--quick", o.quick,
               "field: only the default and one setting of each kind; training: only three rows; embed: only "
               "four small ones; attacks: one severity");
}

int bench_field(const BenchFieldOptions& options, Context& context) {
  if (!options.plot.empty()) check_writable(options.plot);
  const Subject subject = subject_of(options, context);
  const InterruptGuard guard;
  bench::FieldBenchOptions bench{.runs = options.runs, .seed = context.seed(), .quick = options.quick};
  bench::FieldBench result;
  {
    Progress progress = context.progress("bench");
    result = bench::run_field_bench(*subject.field, subject.cameras, bench,
                                    [&](const std::string& what, double part) {
                                      if (guard.interrupted()) throw Interrupted("nothing was written");
                                      progress.update(part, what);
                                    });
  }
  Json rows = Json::array();
  for (const bench::FieldRow& row : result.rows) {
    print_row(context.text(), row);
    rows.push_back(row_json(row));
  }
  const std::string why = bench::judgement(result);
  context.text() << why << "\n";
  if (!options.plot.empty()) write_plot(options.plot, subject, result);
  const nerf::Camera& camera = subject.cameras.front();
  context.result({{"field", subject.name},
                  {"views", subject.cameras.size()},
                  {"width", camera.width},
                  {"height", camera.height},
                  {"isa", isa_name()},
                  {"reference", kReference},
                  {"reference_samples", bench.samples},
                  {"reference_seconds", result.reference_seconds},
                  {"default_on_front", result.rows.front().front},
                  {"judgement", why},
                  {"front_margin_time", bench.margin.time},
                  {"front_margin_psnr", bench.margin.psnr},
                  {"occupancy_says", kOccupancy},
                  {"occupancy", occupancy_json(result.occupancy)},
                  {"rows", rows}});
  return kOk;
}

}  // namespace fieldmark::cli
