#include <fieldmark/engine/isa.h>
#include <fieldmark/tools/bench/embed_bench.h>
#include <fieldmark/tools/results/charts.h>
#include <fieldmark/watermark/mark/owner.h>

#include <filesystem>

#include "cli/bench.h"

namespace fieldmark::cli {
namespace {

constexpr double kFieldSeconds = 60;      // of training, if no field is given
constexpr double kQuickFieldSeconds = 1;  // the same for tests
constexpr std::size_t kQuickRows = 4;     // the default and the other lengths
constexpr Index kQuickViews = 8, kQuickPatch = 48, kQuickChannels = 8, kQuickCells = 6;

struct BenchEmbedArguments {
  std::string owner, field, scene, plot, only;
  double seconds = 90;
  Index views = 24, bits = 16, size = 0;
  bool quick = false;
};

struct EmbedSubject {
  std::unique_ptr<nerf::RadianceField> field;
  std::string name;
};

EmbedSubject embed_subject(const BenchEmbedArguments& o, Context& context) {
  const auto name = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  if (!o.owner.empty())
    return {std::make_unique<nerf::RadianceField>(watermark::Owner::load(o.owner).field), name(o.owner)};
  if (!o.field.empty())
    return {std::make_unique<nerf::RadianceField>(nerf::RadianceField::load(o.field)), name(o.field)};
  const nerf::Dataset data = bench_split(o.scene, "train", o.quick);
  return {trained_field(data, o.quick ? kQuickFieldSeconds : kFieldSeconds, context), data.name};
}

std::vector<bench::EmbedVariant> variants_of(const BenchEmbedArguments& o, const nerf::RadianceField& field,
                                             std::uint64_t seed) {
  auto all =
      bench::embed_variants({.seconds = o.seconds}, o.bits, seed, watermark::colours_for(field.space.kind));
  if (!watermark::all_directions_for(field.space.kind))  // default there
    std::erase_if(all, [](const auto& v) { return v.choice == "directions"; });
  for (bench::EmbedVariant& v : all) {
    if (v.choice == "preset") continue;
    v.recipe.owner.reader_aspect = watermark::reader_aspect(field);
    if (v.choice != "batch") v.recipe.embed.batch = watermark::batch_for(field.space.kind);
  }
  const auto wanted = [&](const bench::EmbedVariant& v) {
    return v.choice == "default" || (v.choice + ": " + v.setting).find(o.only) != std::string::npos;
  };
  std::erase_if(all, [&](const auto& v) { return !wanted(v); });
  if (!o.quick) return all;
  if (all.size() > kQuickRows) all.resize(kQuickRows);
  for (bench::EmbedVariant& v : all) {
    v.recipe.owner.reader_size = kQuickPatch;
    if (v.choice != "preset") v.recipe.cell().base_channels = kQuickChannels;
    v.recipe.cells = kQuickCells;
    v.recipe.views.count = kQuickViews;
  }
  return all;
}

Json embed_rows_json(const std::vector<bench::EmbedRow>& rows, Context& context) {
  const double usual = rows.front().accuracy;
  Json list = Json::array();
  for (const bench::EmbedRow& r : rows) {
    print_line(
        context,
        "%c %-13s %-40s %6.2f%%  %+6.2f  %5.2f dB  %5.1f s  %5ld steps  closer %5.1f%%  farther %5.1f%%  "
        "extrapolated %5.1f%%  sign %5.1f%%  cell %5.1f%%\n",
        r.front ? '*' : ' ', r.variant.choice.c_str(), r.variant.setting.c_str(), 100 * r.accuracy,
        100 * (r.accuracy - usual), r.psnr_foreground, r.seconds, static_cast<long>(r.steps), 100 * r.closer,
        100 * r.farther, 100 * r.extrapolated, 100 * r.figures.sign, 100 * r.figures.index);
    list.push_back({{"choice", r.variant.choice},
                    {"setting", r.variant.setting},
                    {"front", r.front},
                    {"difference", r.accuracy - usual},
                    {"view_seconds", r.cache_seconds},
                    {"seconds", r.seconds},
                    {"accuracy", number(r.accuracy)},
                    {"accuracy_p5", number(r.accuracy_p5)},
                    {"psnr_foreground", number(r.psnr_foreground)},
                    {"closer", number(r.closer)},
                    {"farther", number(r.farther)},
                    {"extrapolated", number(r.extrapolated)},
                    {"steps", r.steps},
                    {"sign", number(r.figures.sign)},
                    {"cell", number(r.figures.index)},
                    {"bits_in_training", number(r.figures.bits)}});
  }
  return list;
}

Json curves_json(const std::vector<bench::EmbedRow>& rows) {
  Json list = Json::array();
  for (const bench::EmbedRow& r : rows)
    for (const bench::EmbedPoint& p : r.curve)
      list.push_back({{"choice", r.variant.choice},
                      {"setting", r.variant.setting},
                      {"seconds", p.seconds},
                      {"accuracy", p.accuracy},
                      {"psnr_foreground", number(p.psnr_foreground)}});
  return list;
}

constexpr const char* kColumns =
    "accuracy: blind, of one view, mean over novel views outside the training set; closer, farther, "
    "extrapolated: the "
    "same for a third as many views of such cameras; seconds: rendering of views, training and calibration; "
    "sign, "
    "cell, bits_in_training: shares right under the distortions of training; curves: during training, a "
    "third of the "
    "views";

int run_bench_embed(const BenchEmbedArguments& options, Context& context) {
  if (!options.plot.empty())
    for (const std::string& file : results::chart_files("embed", options.plot)) check_writable_page(file);
  const EmbedSubject subject = embed_subject(options, context);
  const auto variants = variants_of(options, *subject.field, context.seed());
  auto rows = with_progress(context, [&](const auto& progress) {
    return bench::run_embed_bench(*subject.field, variants,
                                  {.views = options.views, .size = options.size, .seed = context.seed()},
                                  progress);
  });
  const bench::EmbedMargin margin;
  bench::mark_front(rows, margin);
  const Json list = embed_rows_json(rows, context);
  const std::string why = bench::judgement(rows, margin);
  context.text() << why << "\n";
  const Json json{{"field", subject.name},
                  {"bits", options.bits},
                  {"views", options.views},
                  {"isa", isa_name()},
                  {"seconds_each", options.seconds},
                  {"columns", kColumns},
                  {"default_on_front", rows.front().front},
                  {"judgement", why},
                  {"front_margin_time", margin.time},
                  {"front_margin_accuracy", margin.accuracy},
                  {"front_margin_psnr", margin.psnr},
                  {"rows", list},
                  {"curves", curves_json(rows)}};
  if (!options.plot.empty()) results::write_charts("embed", options.plot, json);
  context.result(json);
  return kOk;
}

}  // namespace

Command add_bench_embed(CommandLine& app) {
  auto o = std::make_shared<BenchEmbedArguments>();
  auto field = add_file(app, "--field", o->field,
                        "Unmarked field to mark; default: one trained on --scene for a minute", "FIELD");
  add_file(app, "--owner", o->owner, "Owner file whose unmarked field is marked", "OWNER")->excludes(field);
  add_scene_option(app, o->scene);
  app.option("--scene")->excludes(field)->excludes(app.option("--owner"));
  add_file(app, "--only", o->only, "Rows whose names contain TEXT, besides the default row; default: all",
           "TEXT");
  add_number(app, "--bits", o->bits, 1, 256, "Length of the message in bits, 1 to 256");
  add_number(app, "--seconds", o->seconds, 0.1, 86400, "Embedding time of each row in seconds, 0.1 to 86400",
             "S");
  add_number(app, "--views", o->views, 1, 1000, "Novel views to measure in each row, 1 to 1000");
  add_number(app, "--size", o->size, 16, 8192,
             "Longer side of the views in pixels, 16 to 8192; default: as trained")
      ->default_str("");
  add_plot(app, o->plot);
  app.add_flag("--quick", o->quick, "Measure four rows with small networks");
  return [o](Context& context) { return run_bench_embed(*o, context); };
}

}  // namespace fieldmark::cli
