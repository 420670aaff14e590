#include <fieldmark/engine/image.h>
#include <fieldmark/watermark/embed_views.h>
#include <fieldmark/watermark/embedder.h>
#include <fieldmark/watermark/measurement.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/measured.h"
#include "cli/sheet.h"

namespace fieldmark::cli {
namespace {

namespace wm = watermark;

struct Options {
  std::string field, out, key;
  std::string preset = "fast";
  wm::OwnerOptions owner;
  wm::EmbedOptions embed;
  Index count = 200;
  std::vector<std::string> under;
  double checkpoint_seconds = 120;
  bool resume = false;
};

wm::Owner prepare(const Options& options, Context& context, std::vector<wm::CachedView>& views) {
  auto field = nerf::RadianceField::load(options.field);
  const InterruptGuard guard;
  Progress progress = context.progress("views");
  views = wm::cache_near_views(field, options.owner.reader_size, options.embed.views, context.seed(),
                               [&](Index done, Index total) {
                                 progress.update(static_cast<double>(done) / static_cast<double>(total));
                                 if (guard.interrupted()) throw Interrupted("nothing was written yet");
                                 return true;
                               });
  wm::CellGrid cells(options.owner.cells, wm::visible_area(views, options.owner.cells));
  const wm::Key key = options.resume        ? wm::Embedder::checkpoint_key(options.out + ".checkpoint")
                      : options.key.empty() ? wm::random_key()
                                            : wm::load_key(options.key);
  return wm::Owner(std::move(field), options.owner, key, std::move(cells));
}

void train(const Options& options, wm::Embedder& embedder, const std::string& checkpoint, Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("embed");
  double saved = context.seconds();
  while (!embedder.done()) {
    const double now = context.seconds();
    if (guard.interrupted() || now - saved > options.checkpoint_seconds) {
      embedder.save(checkpoint);
      saved = context.seconds();
    }
    if (guard.interrupted())
      throw Interrupted("after " + std::to_string(embedder.steps()) + " steps, --resume goes on from " +
                        checkpoint);
    embedder.step(now);
    const auto& f = embedder.figures();
    char note[96];
    std::snprintf(note, sizeof note, "step %lld, signs %.1f%%, places %.1f%%, bits %.1f%%",
                  static_cast<long long>(embedder.steps()), 100 * f.sign, 100 * f.index, 100 * f.bits);
    const Index planned = embedder.planned();
    progress.update(planned > 0 ? static_cast<double>(embedder.steps()) / static_cast<double>(planned)
                                : now / options.embed.schedule.seconds,
                    note);
  }
}

// Unmarked, marked with a random message, and ten times the difference, of four views.
void write_sheet(const std::filesystem::path& path, const wm::Owner& owner, std::uint64_t seed) {
  nerf::Renderer plain(owner.field), marked(owner.field);
  marked.set_recolour(owner.marking(
      wm::cell_signs(owner.code(), wm::random_message(owner.options().bits, CounterRng(seed, 51), 0))));
  std::vector<PicturePair> pairs;
  for (const auto& camera : nerf::make_cameras(owner.field.cameras, nerf::CameraSet::near, 4, 0, seed + 51))
    pairs.push_back({plain.render(camera).rgb, marked.render(camera).rgb});
  write_png(path, comparison_sheet(pairs));
}

int run(Options options, Context& context) {
  const std::string checkpoint = options.out + ".checkpoint";
  check_writable(options.out);
  options.owner.seed = options.embed.seed = context.seed();
  std::vector<wm::CachedView> views;
  wm::Owner owner = prepare(options, context, views);
  wm::Embedder embedder(owner, views, options.embed);
  if (options.resume) embedder.restore(checkpoint);
  train(options, embedder, checkpoint, context);
  const double seconds = context.seconds();
  embedder.calibrate();
  owner.save(options.out);
  std::filesystem::remove(checkpoint);
  const auto picture = std::filesystem::path(options.out).replace_extension(".png");
  write_sheet(picture, owner, context.seed());
  context.text() << options.out << ": " << embedder.steps() << " steps in " << format_duration(seconds)
                 << "; what the mark changes: " << picture.string() << "\n";
  Json json{{"seconds", seconds}, {"steps", embedder.steps()}};
  if (options.count > 0) {
    const auto measured =
        measure_mark(owner, {.cameras = "near", .count = options.count, .under = options.under}, context);
    json.update(measured);
  }
  context.result(json);
  return kOk;
}

}  // namespace

Command add_embed(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--field", o->field, "Trained field, stays as it is")->required()->type_name("FIELD");
  app.add_option("--out", o->out, "File for the owner's secret; a picture of the mark goes beside it")
      ->required()
      ->type_name("OWNER");
  app.add_option("--key", o->key, "KEY file (a new key from the operating system)")->type_name("KEY");
  app.add_option("--bits", o->owner.bits, "Length of a message, 1 to 256")
      ->check(CLI::Range(1, 256).description(""))
      ->type_name("N");
  app.add_option("--preset", o->preset, "fast: local message, dense supervision")
      ->check(CLI::IsMember({"fast"}).description(""))
      ->type_name("NAME");
  app.add_option("--strength", o->owner.strength,
                 "PSNR of marked against unmarked on the object, dB, 20 to 60: higher is fainter")
      ->check(CLI::Range(20.0, 60.0).description(""))
      ->type_name("DB");
  CLI::Option* steps =
      app.add_option("--steps", o->embed.schedule.steps, "Length of the run in steps, 1 to 10000000")
          ->check(CLI::Range(1, 10000000).description(""))
          ->type_name("N")
          ->default_str("");
  app.add_option("--seconds", o->embed.schedule.seconds,
                 "Length of the run from its start, loading and caching included, 1 to 1000000")
      ->check(CLI::Range(1.0, 1e6).description(""))
      ->excludes(steps)
      ->type_name("S");
  app.add_option("--views", o->embed.views, "Views to embed in, 8 to 10000")
      ->check(CLI::Range(8, 10000).description(""))
      ->type_name("N");
  app.add_option("--count", o->count, "Views to measure afterwards, 0 to 100000")
      ->check(CLI::Range(0, 100000).description(""))
      ->type_name("N");
  app.add_option("--under", o->under, "Measure under a distortion too, see attack; may be repeated")
      ->type_name("NAME");
  app.add_option("--checkpoint-seconds", o->checkpoint_seconds, "Time between checkpoints, 1 to 1000000")
      ->check(CLI::Range(1.0, 1e6).description(""))
      ->type_name("S");
  app.add_flag("--resume", o->resume,
               "Go on from OWNER.checkpoint, with the options of the run that left it");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
