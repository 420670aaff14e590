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

namespace fieldmark::cli {
namespace {

struct Options {
  std::string data, out;
  std::string background = "white";
  Index size = 0, steps = 0;
  double seconds = 60, target_psnr = 0, checkpoint_seconds = 60;
  bool resume = false;
  nerf::RadianceFieldOptions field;
};

nerf::Background background_of(const std::string& name) {
  return name == "white" ? nerf::Background::white : nerf::Background::black;
}

void train(const Options& options, nerf::Trainer& trainer, const std::string& checkpoint, Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("train");
  double saved = context.seconds();
  while (!trainer.done()) {
    const double now = context.seconds();
    if (guard.interrupted() || now - saved > options.checkpoint_seconds) {
      trainer.save(checkpoint);
      saved = context.seconds();
    }
    if (guard.interrupted())
      throw Interrupted("after " + std::to_string(trainer.steps()) + " steps, --resume goes on from " +
                        checkpoint);
    trainer.step(now);
    if (options.target_psnr > 0 && trainer.train_psnr() >= options.target_psnr) break;
    char note[64];
    std::snprintf(note, sizeof note, "step %lld, %.2f dB on rays trained",
                  static_cast<long long>(trainer.steps()), trainer.train_psnr());
    const double steps = static_cast<double>(trainer.steps());
    progress.update(options.steps > 0 ? steps / static_cast<double>(options.steps) : now / options.seconds,
                    note);
  }
}

// Of the data set's test views, after everything is saved; null where there are none.
Json test_psnr(const Options& options, const nerf::RadianceField& field, Context& context) {
  if (!std::filesystem::exists(std::filesystem::path(options.data) / "transforms_test.json")) return nullptr;
  const auto data = nerf::load_dataset(
      options.data, {.split = "test", .size = options.size, .background = background_of(options.background)});
  Progress progress = context.progress("test views");
  return nerf::evaluate(field, data,
                        [&](Index done, Index total) {
                          progress.update(static_cast<double>(done) / static_cast<double>(total));
                        })
      .mean.psnr;
}

int run(const Options& options, Context& context) {
  const std::string checkpoint = options.out + ".checkpoint";
  check_writable(options.out);
  const auto data = nerf::load_dataset(
      options.data,
      {.split = "train", .size = options.size, .background = background_of(options.background)});
  auto field_options = options.field;
  field_options.seed = context.seed();
  nerf::RadianceField field(field_options);
  const nerf::TrainOptions train_options{.schedule = {.steps = options.steps, .seconds = options.seconds},
                                         .seed = context.seed()};
  nerf::Trainer trainer(field, data, train_options);
  if (options.resume) trainer.restore(checkpoint);

  const double begun = context.seconds(), samples_before = trainer.samples();
  train(options, trainer, checkpoint, context);
  const double seconds = context.seconds();
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
                  {"parameters", field.params.size()},
                  {"file_bytes", bytes}});
  return kOk;
}

}  // namespace

Command add_train(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--data", o->data, "Data set, Blender layout")->required()->type_name("DIR");
  app.add_option("--out", o->out, "File for the field; FIELD.checkpoint while it trains")
      ->required()
      ->type_name("FIELD");
  app.add_option("--size", o->size, "Pixels of the photographs' longer side, 16 to 8192 (as they are)")
      ->check(CLI::Range(16, 8192).description(""))
      ->type_name("N")
      ->default_str("");
  CLI::Option* steps = app.add_option("--steps", o->steps, "Length of the run in steps, 1 to 10000000")
                           ->check(CLI::Range(1, 10000000).description(""))
                           ->type_name("N")
                           ->default_str("");
  app.add_option("--seconds", o->seconds, "Length of the run from its start, loading included, 1 to 1000000")
      ->check(CLI::Range(1.0, 1e6).description(""))
      ->excludes(steps)
      ->type_name("S");
  app.add_option("--target-psnr", o->target_psnr,
                 "End when the rays trained on reach this, dB, 1 to 100 (off)")
      ->check(CLI::Range(1.0, 100.0).description(""))
      ->type_name("DB")
      ->default_str("");
  app.add_option("--background", o->background, "Behind transparent photographs: white, black")
      ->check(CLI::IsMember({"white", "black"}).description(""))
      ->type_name("COLOUR");
  app.add_option("--checkpoint-seconds", o->checkpoint_seconds, "Time between checkpoints, 1 to 1000000")
      ->check(CLI::Range(1.0, 1e6).description(""))
      ->type_name("S");
  app.add_flag("--resume", o->resume,
               "Go on from FIELD.checkpoint, with the options of the run that left it");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
