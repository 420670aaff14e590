#include <fieldmark/engine/isa.h>
#include <fieldmark/tools/bench/field_bench.h>
#include <fieldmark/tools/results/charts.h>

#include <filesystem>
#include <optional>

#include "cli/bench.h"

namespace fieldmark::cli {
namespace {

struct BenchFieldArguments {
  std::string field, scene, plot;
  Index size = 400, views = 3;
  double seconds = 60;
  int runs = 5;
  bool quick = false;
};

struct FieldSubject {
  std::unique_ptr<nerf::RadianceField> field;
  std::vector<nerf::Camera> cameras;
  std::string name;
};

// Takes views spread evenly over the test split; without a data set, draws them around the training cameras.
FieldSubject field_subject(const BenchFieldArguments& options, Context& context) {
  FieldSubject subject;
  const bool stored = !options.field.empty();
  if (stored) {
    subject.field = std::make_unique<nerf::RadianceField>(nerf::RadianceField::load(options.field));
    subject.name = std::filesystem::path(options.field).filename().string();
    if (options.scene.empty()) {
      subject.cameras = nerf::make_cameras(subject.field->cameras, nerf::CameraSet::novel, options.views,
                                           options.size, context.seed());
      return subject;
    }
  }
  const nerf::Dataset test = bench_split(options.scene, "test", options.quick);
  const auto all = static_cast<Index>(test.views.size()), count = std::min(options.views, all);
  for (Index i = 0; i < count; ++i)
    subject.cameras.push_back(
        test.views[static_cast<std::size_t>(i * all / count)].camera.scaled(options.size));
  if (!stored) {
    const nerf::Dataset data = bench_split(options.scene, "train", options.quick);
    subject.field = trained_field(data, options.seconds, context);
    subject.name = data.name;
  }
  return subject;
}

constexpr const char* kReference =
    "rays, look-ups, networks and composite in double; samples spread evenly over each ray's way through the "
    "cube; no early termination; matter where the occupancy grid of the FIELD has occupied cells";
constexpr const char* kOccupancy =
    "the reference with the occupancy grid against the reference without, on random pixels; a field is not "
    "trained "
    "outside the silhouettes, so a grid that follows them loses nothing there";

Json field_rows_json(const bench::FieldBench& result, Context& context) {
  Json rows = Json::array();
  for (const bench::FieldRow& r : result.rows) {
    print_line(context,
               "%c %-12s %-48s %7.4f s  %6.2f dB  max %.3f  dropped %.1e, at most %.3f  spread %2.0f%%\n",
               r.front ? '*' : ' ', r.variant.knob.c_str(), r.variant.setting.c_str(), r.seconds, r.psnr,
               r.max_error, r.dropped_mean, r.dropped_max, 100 * r.spread);
    rows.push_back({{"knob", r.variant.knob},
                    {"setting", r.variant.setting},
                    {"seconds", r.seconds},
                    {"spread", r.spread},
                    {"psnr", number(r.psnr)},
                    {"max_error", r.max_error},
                    {"dropped_mean", r.dropped_mean},
                    {"dropped_max", r.dropped_max},
                    {"grid_kb", r.grid_bytes / 1000},
                    {"front", r.front}});
  }
  return rows;
}

int run_bench_field(const BenchFieldArguments& options, Context& context) {
  if (!options.plot.empty()) check_writable_page(options.plot);
  const FieldSubject subject = field_subject(options, context);
  const bench::FieldBenchOptions bench{.runs = options.runs, .seed = context.seed(), .quick = options.quick};
  const bench::FieldBench result = with_progress(context, [&](const auto& progress) {
    return bench::run_field_bench(*subject.field, subject.cameras, bench, progress);
  });
  const Json rows = field_rows_json(result, context);
  const std::string why = bench::judgement(result);
  context.text() << why << "\n";
  const nerf::Camera& camera = subject.cameras.front();
  const bench::OccupancyCost& cost = result.occupancy;
  const Json json{{"field", subject.name},
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
                  {"occupancy",
                   {{"pixels", cost.pixels},
                    {"psnr", number(cost.psnr)},
                    {"max_error", cost.max_error},
                    {"dropped_mean", cost.dropped_mean},
                    {"dropped_max", cost.dropped_max}}},
                  {"rows", rows}};
  if (!options.plot.empty()) results::write_charts("field", options.plot, json);
  context.result(json);
  return kOk;
}

}  // namespace

Command add_bench_field(CommandLine& app) {
  auto o = std::make_shared<BenchFieldArguments>();
  auto field = add_file(app, "--field", o->field,
                        "Field to render; default: one trained on --scene for --seconds", "FIELD");
  add_scene_option(app, o->scene);
  add_number(app, "--seconds", o->seconds, 0.1, 86400, "Training time of the field in seconds, 0.1 to 86400",
             "S")
      ->excludes(field);
  add_number(app, "--size", o->size, 16, 8192, "Longer side of the views in pixels, 16 to 8192");
  add_number(app, "--views", o->views, 1, 1000, "Views to render in each row, 1 to 1000");
  add_number(app, "--runs", o->runs, 1, 1000, "Runs of each row, 1 to 1000; their median counts");
  add_plot(app, o->plot);
  app.add_flag("--quick", o->quick, "Measure one setting of each kind");
  return [o](Context& context) { return run_bench_field(*o, context); };
}

}  // namespace fieldmark::cli
