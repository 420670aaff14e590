#include "cli/bench_embed.h"

#include <fieldmark/core/files.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/imaging/scatter_chart.h>
#include <fieldmark/tools/bench/embed_bench.h>
#include <fieldmark/watermark/mark/owner.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/context.h"
#include "cli/embed_rows.h"

namespace fieldmark::cli {
namespace {

constexpr double kFieldSeconds = 60;      // of training, where no field is given
constexpr double kQuickFieldSeconds = 1;  // the same for tests
constexpr std::size_t kQuickRows = 4;     // the default and the other lengths
constexpr Index kQuickViews = 8, kQuickPatch = 48, kQuickChannels = 8, kQuickCells = 6;

struct Subject {
  std::unique_ptr<nerf::RadianceField> field;
  std::string name;
};

Subject subject_of(const BenchEmbedOptions& o, Context& context) {
  const auto name = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  if (!o.owner.empty())
    return {std::make_unique<nerf::RadianceField>(watermark::Owner::load(o.owner).field), name(o.owner)};
  if (!o.field.empty())
    return {std::make_unique<nerf::RadianceField>(nerf::RadianceField::load(o.field)), name(o.field)};
  const nerf::Dataset data = bench_split(o.scene.empty() ? lego_folder() : o.scene, "train", o.quick);
  return {trained_field(data, o.quick ? kQuickFieldSeconds : kFieldSeconds, context), data.name};
}

std::vector<bench::EmbedVariant> variants_of(const BenchEmbedOptions& o, const nerf::RadianceField& field,
                                             const std::vector<bench::EmbedRow>& known, std::uint64_t seed) {
  auto all =
      bench::embed_variants({.seconds = o.seconds}, o.bits, seed, watermark::colours_for(field.space.kind));
  for (bench::EmbedVariant& v : all) {
    if (v.choice == "preset") continue;
    v.recipe.owner.reader_aspect = watermark::reader_aspect(field);
    if (v.choice != "batch") v.recipe.embed.batch = watermark::batch_for(field.space.kind);
  }
  const auto wanted = [&](const bench::EmbedVariant& v) {
    return v.choice == "default" || bench::find_row(known, v) ||
           (v.choice + ": " + v.setting).find(o.only) != std::string::npos;
  };
  std::erase_if(all, [&](const auto& v) { return !wanted(v); });
  if (!o.quick) return all;
  if (all.size() > kQuickRows) all.resize(kQuickRows);
  for (bench::EmbedVariant& v : all) {
    v.recipe.owner.reader_size = kQuickPatch;
    if (v.choice != "preset") v.recipe.cell().base_channels = kQuickChannels;
    v.recipe.cells = kQuickCells;
    v.views.count = kQuickViews;
  }
  return all;
}

Json row_json(const bench::EmbedRow& r, double usual, const std::string& commit) {
  Json json{{"choice", r.variant.choice},
            {"setting", r.variant.setting},
            {"front", r.front},
            {"difference", r.accuracy - usual}};
  json.update(embed_figures(r));
  json["commit"] = commit;
  return json;
}

void print_row(std::ostream& out, const bench::EmbedRow& r, double usual) {
  char line[280];
  std::snprintf(
      line, sizeof line,
      "%c %-13s %-40s %6.2f%%  %+6.2f  %5.2f dB  %5.1f s  %5ld steps  closer %5.1f%%  farther %5.1f%%  "
      "unseen %5.1f%%  sign %5.1f%%  cell %5.1f%%\n",
      r.front ? '*' : ' ', r.variant.choice.c_str(), r.variant.setting.c_str(), 100 * r.accuracy,
      100 * (r.accuracy - usual), r.psnr_foreground, r.seconds, static_cast<long>(r.steps), 100 * r.closer,
      100 * r.farther, 100 * r.unseen, 100 * r.figures.sign, 100 * r.figures.index);
  out << line;
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

std::string name_of(const bench::EmbedRow& r) {
  return r.variant.choice == "default" ? "default" : r.variant.choice + ": " + r.variant.setting;
}

std::filesystem::path curves_path(std::filesystem::path path) {
  return path.replace_filename(path.stem().string() + "-curves" + path.extension().string());
}

// Accuracy and strength against time: one image of where the runs ended, one of the way of those on the
// front.
void write_plots(const std::string& path, const std::string& name, const std::vector<bench::EmbedRow>& rows) {
  const char* seconds = "seconds of embedding";
  std::vector<bench::ScatterPoint> ends, ways;
  for (const bench::EmbedRow& r : rows) {
    const bool first = &r == rows.data();
    char label[160];
    std::snprintf(label, sizeof label, "%s, %.1f dB", name_of(r).c_str(), r.psnr_foreground);
    ends.push_back({.x = r.seconds,
                    .y = 100 * r.accuracy,
                    .series = first                          ? "default"
                              : r.variant.choice == "length" ? "default, other lengths"
                              : r.front                      ? "on the front"
                                                             : "others",
                    .label = r.front ? label : "",
                    .ring = first});
    if (!first && !r.front) continue;
    for (const bench::EmbedPoint& p : r.curve)
      ways.push_back({.x = p.seconds, .y = 100 * p.accuracy, .series = name_of(r)});
  }
  const std::string y = "bits right in one view, blind, %";
  write_file_atomically(
      path,
      bench::scatter_chart({.title = "Embedding in " + name + ": what is read against time",
                            .x = std::string(seconds) + " (the ring is the default; names: on the front)",
                            .y = y,
                            .y_most = 100},
                           ends));
  write_file_atomically(curves_path(path),
                        bench::scatter_chart({.title = "Embedding in " + name + ": the way there",
                                              .x = seconds,
                                              .y = y,
                                              .curves = true,
                                              .y_most = 100},
                                             ways));
}

EmbedRows kept_rows(const BenchEmbedOptions& o, const std::string& field, Context& context) {
  return {o.rows,
          {{"field", field},
           {"bits", o.bits},
           {"seconds", o.seconds},
           {"views", o.views},
           {"size", o.size},
           {"seed", context.seed()},
           {"quick", o.quick}}};
}

std::vector<bench::EmbedRow> measured(const BenchEmbedOptions& o, const nerf::RadianceField& field,
                                      EmbedRows& kept, Context& context) {
  const auto variants = variants_of(o, field, kept.rows(), context.seed());
  const InterruptGuard guard;
  Progress progress = context.progress("bench");
  return bench::run_embed_bench(
      field, variants,
      {.views = o.views,
       .size = o.size,
       .seed = context.seed(),
       .known = kept.rows(),
       .on_row = [&](const bench::EmbedRow& row) { kept.add(row); }},
      [&](const std::string& what, double part) {
        if (guard.interrupted())
          throw Interrupted(o.rows.empty() ? "nothing was written" : "what was measured is in " + o.rows);
        progress.update(part, what);
      });
}

constexpr const char* kColumns =
    "accuracy: blind, of one view, mean over novel views that were not learnt from; closer, farther, unseen: "
    "of "
    "a third as many views of such cameras; seconds: views, training and calibration; sign, cell, "
    "bits_in_training: shares right under the distortions of training; curves: on the way, a third of the "
    "views";

}  // namespace

int bench_embed(const BenchEmbedOptions& options, Context& context) {
  if (!options.plot.empty()) {
    check_writable(options.plot);
    check_writable(curves_path(options.plot).string());
  }
  if (!options.rows.empty()) check_writable(options.rows);
  const Subject subject = subject_of(options, context);
  EmbedRows kept = kept_rows(options, subject.name, context);
  auto rows = measured(options, *subject.field, kept, context);
  const bench::EmbedMargin margin;
  bench::mark_front(rows, margin);
  const double usual = rows.front().accuracy;
  Json list = Json::array();
  for (const bench::EmbedRow& row : rows) {
    print_row(context.text(), row, usual);
    list.push_back(row_json(row, usual, kept.commit_of(row)));
  }
  const std::string why = bench::judgement(rows, margin);
  context.text() << why << "\n";
  if (!options.plot.empty()) write_plots(options.plot, subject.name, rows);
  context.result({{"field", subject.name},
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
                  {"curves", curves_json(rows)}});
  return kOk;
}

}  // namespace fieldmark::cli
