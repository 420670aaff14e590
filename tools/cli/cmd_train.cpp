#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/trainer.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/long_run.h"
#include "cli/precision.h"
#include "cli/scene_data.h"

namespace fieldmark::cli {
namespace {

constexpr double kHeaderBytes = 32e3;  // names and metadata, cameras included

struct Options {
  std::string data, out;
  std::string preset = "hash", background, precision = "fp32";
  Index size = 0;
  RunLength length;
  double target_psnr = 0, max_megabytes = 0;
  bool resume = false, no_carve = false;
};

std::optional<nerf::Background> background_of(const std::string& name) {
  if (name.empty()) return std::nullopt;
  return name == "white" ? nerf::Background::white : nerf::Background::black;
}

// The largest table whose field's numbers fit; the rest of the file is small.
nerf::RadianceFieldOptions field_options(const Options& options, std::uint64_t seed) {
  nerf::RadianceFieldOptions field;
  field.seed = seed;
  if (options.preset == "mlp") field.field.kind = nerf::FieldKind::mlp;
  if (options.max_megabytes <= 0) return field;
  const int least = field.field.kind == nerf::FieldKind::mlp ? field.field.encoding.log2_table : 4;
  for (int log2 = field.field.encoding.log2_table; log2 >= least; --log2) {
    field.field.encoding.log2_table = log2;
    const nerf::RadianceField made(field);
    const double bytes =
        4.0 * static_cast<double>(made.params.size()) + static_cast<double>(made.grid.cells()) / 8;
    if (bytes + kHeaderBytes <= options.max_megabytes * 1e6) return field;
  }
  throw UsageError("--max-megabytes: no field is as small as " + std::to_string(options.max_megabytes) +
                   " MB");
}

double train(const Options& options, nerf::Trainer& trainer, const std::string& checkpoint,
             Context& context) {
  const bool has_target = options.target_psnr > 0;
  return run_long(
      {.what = "train",
       .done = [&] { return trainer.done() || (has_target && trainer.train_psnr() >= options.target_psnr); },
       .step = [&](double seconds) { trainer.step(seconds); },
       .steps = [&] { return trainer.steps(); },
       .note =
           [&] {
             char note[64];
             std::snprintf(note, sizeof note, "%.2f dB on the rays trained", trainer.train_psnr());
             return std::string(note);
           },
       .save = [&] { trainer.save(checkpoint); },
       .checkpoint = checkpoint},
      options.length, context);
}

// Of the data set's test views, after everything is saved; null where there are none.
Json test_psnr(const Options& options, const nerf::RadianceField& field, Context& context) {
  if (!nerf::has_split(options.data, "test")) return nullptr;
  const auto data = load_scene(
      options.data, {.split = "test", .size = options.size, .background = background_of(options.background)},
      context);
  nerf::Renderer renderer(field);
  const InterruptGuard guard;
  Progress progress = context.progress("test views");
  const auto evaluation = nerf::evaluate(renderer, data, [&](Index done, Index total) {
    progress.update(static_cast<double>(done) / static_cast<double>(total));
    return !guard.interrupted();
  });
  if (guard.interrupted()) throw Interrupted("the field is complete, its test views are not");
  return evaluation.psnr;
}

int run(const Options& options, Context& context) {
  const std::string checkpoint = options.out + ".checkpoint";
  check_writable(options.out);
  const auto data = load_scene(
      options.data, {.split = "train", .size = options.size, .background = background_of(options.background)},
      context);
  nerf::RadianceField field(field_options(options, context.seed()));
  nerf::TrainOptions train_options = nerf::train_options(field.options().field.kind);
  train_options.schedule.steps = options.length.steps;
  train_options.schedule.seconds = options.length.seconds;
  train_options.seed = context.seed();
  train_options.precision = precision_of(options.precision);
  train_options.carve = !options.no_carve;
  nerf::Trainer trainer(field, data, train_options);
  if (options.resume) trainer.restore(checkpoint);

  const double begun = context.seconds(), samples_before = trainer.samples();
  const InterruptGuard until_saved;  // between the last step and the file, Ctrl-C waits
  const double seconds = train(options, trainer, checkpoint, context);
  field.save(options.out);
  std::filesystem::remove(checkpoint);

  const Json psnr = test_psnr(options, field, context);
  const auto bytes = std::filesystem::file_size(options.out);
  char line[200];
  std::snprintf(line, sizeof line, "%lld steps in %.1f s, %.2f MB", static_cast<long long>(trainer.steps()),
                seconds, static_cast<double>(bytes) / 1e6);
  context.text() << options.out << ": " << line;
  if (!psnr.is_null()) {
    std::snprintf(line, sizeof line, ", %.2f dB on the test views", psnr.get<double>());
    context.text() << line;
  }
  context.text() << "\n";
  context.result({{"test_psnr", psnr},
                  {"train_seconds", seconds},
                  {"steps", trainer.steps()},
                  {"samples_per_second", (trainer.samples() - samples_before) / (seconds - begun)},
                  {"parameters", field.params.parameters()},
                  {"file_bytes", bytes}});
  return kOk;
}

}  // namespace

Command add_train(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option(
         "--data", o->data,
         "Data set: folder of transforms_*.json, transforms.json, poses_bounds.npy (LLFF) or a COLMAP model")
      ->required()
      ->type_name("DIR");
  app.add_option("--out", o->out, "File for the field; FIELD.checkpoint while it trains")
      ->required()
      ->type_name("FIELD");
  app.add_option("--size", o->size, "Pixels of the photographs' longer side, 16 to 8192 (as they are)")
      ->check(CLI::Range(16, 8192).description(""))
      ->type_name("N")
      ->default_str("");
  app.add_option("--preset", o->preset,
                 "hash: multiresolution hash table with small networks;\n"
                 "mlp: the original field, coarse and fine networks of 8 layers of 256")
      ->check(CLI::IsMember({"hash", "mlp"}).description(""))
      ->type_name("NAME");
  add_run_length(app, o->length, true);
  add_precision(app, o->precision);
  app.add_option("--target-psnr", o->target_psnr,
                 "End when the rays trained on reach this, dB, 1 to 100 (off)")
      ->check(CLI::Range(1.0, 100.0).description(""))
      ->type_name("DB")
      ->default_str("");
  app.add_option("--background", o->background,
                 "Behind transparent pictures: white, black (white for the Blender layout, else black)")
      ->check(CLI::IsMember({"white", "black"}).description(""))
      ->type_name("COLOUR")
      ->default_str("");
  app.add_option("--max-megabytes", o->max_megabytes,
                 "Largest file for the field, MB, 0.1 to 100000 (no limit)")
      ->check(CLI::Range(0.1, 1e5).description(""))
      ->type_name("M")
      ->default_str("");
  app.add_flag("--no-carve", o->no_carve, "Do not rule out what silhouettes show to be empty");
  app.add_flag("--resume", o->resume,
               "Go on from FIELD.checkpoint, with the options of the run that left it");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
