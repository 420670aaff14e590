#include <fieldmark/core/digest.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/embedding/embedder.h>
#include <fieldmark/watermark/embedding/mark_colours.h>
#include <fieldmark/watermark/evidence/commitment.h>
#include <fieldmark/watermark/keys/signing.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <span>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/long_run.h"
#include "cli/measured.h"
#include "cli/message_option.h"
#include "cli/perceptual.h"
#include <fieldmark/tools/results/sheet.h>

namespace fieldmark::cli {
namespace {

constexpr Index kImagedViews = 4;

struct Options {
  std::string field, out, key, image, lpips_weights;
  std::string preset = "fast", distances = "novel", colours;
  watermark::OwnerOptions owner;
  MessageOption intended;
  RunLength length{.seconds = watermark::EmbedOptions{}.schedule.seconds};
  Index views = watermark::EmbedOptions{}.views, samples = 0, batch = 0, measured_views = 200;
  std::vector<std::string> under;
  bool resume = false, reader_size_given = false, cells_given = false;
};

constexpr Index kPaperPatch = 150;  // pixels, Luo et al. 2023, section 4.1

// A run that was begun without --key made one, and its checkpoint has it.
watermark::Key key_of(const Options& options, const std::string& checkpoint) {
  if (!options.key.empty()) return watermark::load_key(options.key);
  if (options.resume) return watermark::Embedder::checkpoint_key(checkpoint);
  return watermark::random_key();
}

std::vector<watermark::CachedView> cached_views(const Options& options, const nerf::RadianceField& field,
                                                const watermark::PatchSize& patch, Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("views");
  const watermark::EmbedViewOptions views{.count = options.views,
                                          .samples = options.samples,
                                          .distances = watermark::parse_distances(options.distances)};
  return watermark::cache_embed_views(field, patch, views, context.seed(), [&](Index done, Index total) {
    if (guard.interrupted()) throw Interrupted("nothing was written");
    progress.update(static_cast<double>(done) / static_cast<double>(total));
    return true;
  });
}

double embed(const Options& options, watermark::Embedder& embedder, const std::string& checkpoint,
             Context& context) {
  return run_long({.what = "embed",
                   .done = [&] { return embedder.done(); },
                   .step = [&](double seconds) { embedder.step(seconds); },
                   .steps = [&] { return embedder.steps(); },
                   .note =
                       [&] {
                         const auto& f = embedder.figures();
                         char note[96];
                         if (options.preset == "paper")
                           std::snprintf(note, sizeof note, "right: bits %.1f%%  loss %.4f", 100 * f.bits,
                                         f.loss);
                         else
                           std::snprintf(note, sizeof note, "right: sign %.1f%%  cell %.1f%%  bits %.1f%%",
                                         100 * f.sign, 100 * f.index, 100 * f.bits);
                         return std::string(note);
                       },
                   .save = [&] { embedder.save(checkpoint); },
                   .checkpoint = checkpoint},
                  options.length, context);
}

void write_image(const std::string& path, const watermark::Owner& owner, std::uint64_t seed) {
  nerf::Renderer plain(owner.field), marked(owner.field);
  const CounterRng rng(seed, 51);
  marked.set_recolour(owner.marking(
      watermark::cell_signs(owner.code(), watermark::random_message(owner.options().bits, rng, 0))));
  std::vector<results::ImagePair> pairs;
  for (const auto& camera :
       nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, kImagedViews, 0, seed))
    pairs.push_back({plain.render(camera).rgb, marked.render(camera).rgb});
  write_png(path, results::comparison_sheet(pairs));
}

watermark::OwnerOptions owner_options_of(const Options& options, std::uint64_t seed) {
  watermark::OwnerOptions owner = options.owner;
  owner.preset = watermark::parse_preset(options.preset);
  const auto preset = watermark::owner_options(owner.preset);
  owner.message_features = preset.message_features;
  owner.fusion = preset.fusion;
  owner.seed = seed;
  if (owner.preset != watermark::Preset::fast && !options.reader_size_given) owner.reader_size = kPaperPatch;
  return owner;
}

void suit_scene(const Options& options, const nerf::RadianceField& field, watermark::OwnerOptions& owner,
                watermark::EmbedOptions& embed) {
  owner.reader_aspect = watermark::reader_aspect(field);
  watermark::use_colours(options.colours.empty() ? watermark::colours_for(field.space.kind)
                                                 : watermark::parse_mark_colours(options.colours),
                         owner.mark, embed);
  embed.batch = options.batch > 0 ? options.batch : watermark::batch_for(field.space.kind);
}

void choose_cells(std::span<const watermark::CachedView> views, nerf::SpaceKind space,
                  watermark::OwnerOptions& owner, Context& context) {
  owner.cells = watermark::cells_for_message(views, owner.bits, space);
  const double shown = watermark::cells_shown(views, owner.cells);
  context.text() << owner.cells << " cells an axis: nine of ten views show " << std::lround(shown)
                 << " or more, for " << owner.bits << " bits\n";
  if (shown < static_cast<double>(owner.bits))
    context.note(
        "many views show fewer cells than the message has bits, and of one such view some bits are guesses: "
        "take fewer --bits, or read several views");
}

// From views that the owner has not learnt from.
Json measure_owner(const Options& options, const watermark::Owner& owner, const Lpips<float>* lpips,
                   Context& context) {
  const auto cameras = nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, options.measured_views,
                                          0, context.seed() + 1);
  const auto measured = run_measure(
      owner, nullptr, nullptr,
      {.cameras = cameras, .under = options.under, .seed = context.seed(), .lpips = lpips, .progress = {}},
      context);
  print_measurement(context.text(), measured, "novel");
  return measurement_json(measured, "novel");
}

int run(const Options& options, Context& context) {
  const std::string checkpoint = options.out + ".checkpoint";
  const std::string picture = options.image.empty() ? options.out + ".png" : options.image;
  if (std::filesystem::exists(options.out) && std::filesystem::equivalent(options.out, options.field))
    throw UsageError("--out: " + options.out + " is the field that is to be marked");
  check_writable(options.out);
  check_writable(picture);
  for (const auto& name : options.under)
    read_option("--distort", [&] { return distort::parse_distortion(name); });
  std::optional<watermark::Message> intended;
  if (options.intended.given()) intended = message_of(options.intended, options.owner.bits);
  const auto lpips = load_lpips(LpipsNetwork::alex, options.lpips_weights, context);
  const auto field = nerf::RadianceField::load(options.field);
  const auto key = key_of(options, checkpoint);
  auto owner_options = owner_options_of(options, context.seed());
  const bool fast = owner_options.preset == watermark::Preset::fast;
  auto embed_options = watermark::embed_options(owner_options.preset);
  if (fast) suit_scene(options, field, owner_options, embed_options);
  const auto views = cached_views(options, field, owner_options.patch(), context);
  if (fast && !options.cells_given) choose_cells(views, field.space.kind, owner_options, context);
  auto cells =
      fast ? watermark::CellGrid(owner_options.cells, watermark::visible_area(views, owner_options.cells))
           : watermark::message_slots(owner_options.bits);
  owner_options.cells = cells.side();
  watermark::Owner owner(field, owner_options, key, std::move(cells));
  embed_options.views = options.views;
  embed_options.seed = context.seed();
  embed_options.schedule.steps = options.length.steps;
  embed_options.schedule.seconds = options.length.seconds;
  watermark::Embedder embedder(owner, views, embed_options);
  if (options.resume) embedder.restore(checkpoint);

  const InterruptGuard until_saved;  // between the last step and the file, Ctrl-C waits
  const double seconds = embed(options, embedder, checkpoint, context);
  embedder.calibrate();
  owner.save(options.out);
  std::filesystem::remove(checkpoint);
  write_image(picture, owner, context.seed());

  const auto sha256 = sha256_file_hex(options.out);
  const auto open = to_hex(watermark::public_key(owner.key));
  context.text() << options.out << ": " << embedder.steps() << " steps in " << format_duration(seconds)
                 << ", keep it secret\nsha256 " << sha256 << "\npublic key " << open << "\n"
                 << picture << ": unmarked, marked, ten times the difference\n";
  Json commitment = nullptr;
  if (intended) {
    commitment = watermark::commitment(sha256, owner.key, *intended);
    context.text() << "commitment " << commitment.get<std::string>()
                   << ", to be time-stamped before the field is published\n";
  }
  Json json = measure_owner(options, owner, lpips ? &*lpips : nullptr, context);
  json["seconds"] = seconds;
  json["steps"] = embedder.steps();
  json["cells"] = owner.options().cells;
  json["sha256"] = sha256;
  json["commitment"] = commitment;
  json["public_key"] = open;
  context.result(json);
  return kOk;
}

void add_view_options(CommandLine& app, Options& o) {
  app.add_option("--views", o.views, "Views to learn from, 8 to 10000")->range(8, 10000)->type_name("N");
  app.add_option("--distances", o.distances,
                 "near: novel cameras, the object always as large as the extractor sees it;\n"
                 "native: only as large as their images have it; several: also closer and farther cameras")
      ->one_of({"novel", "native", "several"})
      ->type_name("NAME");
  app.add_option("--samples", o.samples,
                 "Parts of a ray that the mark of a pixel is the sum of, 1 to 64 (1; 4 in scenes without "
                 "bounds)")
      ->range(1, 64)
      ->type_name("N")
      ->default_str("");
  app.add_option("--batch", o.batch,
                 "Images a step, 1 to 64 (4; 2 in scenes without bounds); presets paper and code take 4")
      ->range(1, 64)
      ->type_name("N")
      ->default_str("");
}

}  // namespace

Command add_embed(CommandLine& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--field", o->field, "Trained field; it stays as it is")->required()->type_name("FIELD");
  app.add_option("--out", o->out, "File for the owner; OWNER.checkpoint while it trains")
      ->required()
      ->type_name("OWNER");
  app.add_option("--key", o->key, "Key of `fieldmark key` (a new one, inside OWNER)")
      ->type_name("KEY")
      ->default_str("");
  app.add_option("--bits", o->owner.bits, "Length of a message, 1 to 256")->range(1, 256)->type_name("N");
  add_message_options(app, o->intended, "Message that is going to be baked, to print its commitment at once");
  app.add_option("--preset", o->preset,
                 "fast: local message with dense supervision, trains in minutes; paper: one message "
                 "everywhere, pooled reading, --mark-psnr and --cells unused; code: the same as the paper's "
                 "authors have it in their code")
      ->one_of({"fast", "paper", "code"})
      ->type_name("NAME");
  app.add_option("--mark-psnr", o->owner.mark_psnr,
                 "PSNR of the mark on the object, dB, 20 to 60; higher is fainter")
      ->range(20.0, 60.0)
      ->type_name("DB");
  const Option cells =
      app.add_option("--cells", o->owner.cells,
                     "Cells an axis of the scene's cube, 2 to 64 (16 to 64: as many as a view needs to show "
                     "two or more for each bit, eight in scenes without bounds)")
          ->range(2, 64)
          ->type_name("N")
          ->default_str("");
  const Option reader_size =
      app.add_option("--reader-size", o->owner.reader_size,
                     "Longer side of what the extractor sees, pixels, 32 to 1024 (160; paper, "
                     "code: 150): objects in a square, photographs without a background in "
                     "their own shape")
          ->range(32, 1024)
          ->type_name("N");
  app.add_option(
         "--colours", o->colours,
         "How the mark looks: light, like an uneven light, least seen; blue, blue and yellow, read sooner "
         "(light in scenes without bounds, blue on objects; presets paper and code choose their own)")
      ->one_of({"light", "blue"})
      ->type_name("NAME")
      ->default_str("");
  add_view_options(app, *o);
  add_run_length(app, o->length, true);
  app.add_option("--measured-views", o->measured_views, "Novel views to measure on at the end, 1 to 100000")
      ->range(1, 100000)
      ->type_name("N");
  app.add_option("--distort", o->under,
                 "Distortions to measure under besides none (see attack), several times")
      ->type_name("NAME")
      ->default_str("");
  app.add_option("--image", o->image, "PNG with four views unmarked, marked, and the difference (OWNER.png)")
      ->type_name("FILE")
      ->default_str("");
  add_lpips_weights(app, o->lpips_weights);
  app.add_flag("--resume", o->resume,
               "Go on from OWNER.checkpoint, with the options of the run that left it");
  return [o, reader_size, cells](Context& context) {
    o->reader_size_given = reader_size->count() > 0;
    o->cells_given = cells->count() > 0;
    return run(*o, context);
  };
}

}  // namespace fieldmark::cli
