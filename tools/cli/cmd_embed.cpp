#include <fieldmark/core/digest.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/embedding/recipe.h>
#include <fieldmark/watermark/evidence/commitment.h>
#include <fieldmark/watermark/keys/signing.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <span>

#include <fieldmark/tools/results/sheet.h>
#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/long_run.h"
#include "cli/lpips.h"
#include "cli/measured.h"
#include "cli/message_option.h"
#include "cli/perceptual_term.h"

namespace fieldmark::cli {
namespace {

constexpr Index kImagedViews = 4;

struct EmbedArguments {
  std::string field, out, key, image, lpips_weights, vgg_weights;
  std::string preset = "fast", distances = "novel";
  Index bits = watermark::OwnerOptions{}.bits;
  // Empty or 0, which no option accepts: chosen by the preset or the scene.
  std::string colours, directions;
  double mark_psnr = 0, perceptual = 0;
  Index cells = 0, batch = 0, reader_size = 0;
  RunLength length{.seconds = 0};
  MessageOption intended;
  Index views = watermark::EmbedViewOptions{}.count, samples = 0, measured_views = 200;
  std::vector<std::string> under;
  bool no_key = false, resume = false;
};

// Returns the key. A run that started without --key made one and stored it in its checkpoint.
watermark::Key key_of(const EmbedArguments& options, const std::string& checkpoint) {
  if (options.resume && options.no_key == SafetensorsFile::read(checkpoint).has("key"))
    throw UsageError(options.no_key ? "--no-key: the interrupted run kept its key; resume without this option"
                                    : "--resume: the interrupted run had --no-key; repeat it and its --key");
  if (!options.key.empty()) return watermark::load_key(options.key);
  if (options.resume) return watermark::Embedder::checkpoint_key(checkpoint);
  return watermark::random_key();
}

std::vector<watermark::CachedView> cached_views(const EmbedArguments& options,
                                                const nerf::RadianceField& field,
                                                const watermark::EmbedRecipe& recipe, Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("views");
  watermark::EmbedViewOptions views = recipe.views;
  views.count = options.views;
  views.samples = options.samples;
  views.distances = watermark::parse_distances(options.distances);
  if (!options.directions.empty()) views.all_directions = options.directions == "all";
  const auto report = [&](Index done, Index total) {
    if (guard.interrupted()) throw Interrupted("nothing was written");
    progress.update(static_cast<double>(done) / static_cast<double>(total));
    return true;
  };
  return watermark::cache_embed_views(field, recipe.owner.patch(), views, context.seed(), report);
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

watermark::EmbedRecipe recipe_of(const EmbedArguments& options, const nerf::RadianceField& field,
                                 Context& context) {
  const std::uint64_t seed = context.seed();
  auto recipe = watermark::embed_recipe(options.preset);
  recipe.suit(field);
  recipe.owner.bits = options.bits;
  recipe.owner.seed = recipe.embed.seed = seed;
  recipe.embed.schedule.steps = options.length.steps;
  if (options.length.seconds > 0) recipe.embed.schedule.seconds = options.length.seconds;
  if (options.reader_size > 0) recipe.owner.reader_size = options.reader_size;
  const auto set_cell_option = [&](const char* name, const auto& value, auto set) {
    if (value != std::decay_t<decltype(value)>{}) read_option(name, [&] { set(recipe.cell(), value); });
  };
  set_cell_option("--mark-psnr", options.mark_psnr, [&](auto&, double db) { recipe.owner.mark_psnr = db; });
  set_cell_option("--cells", options.cells, [&](auto&, Index side) { recipe.cells = side; });
  set_cell_option("--batch", options.batch, [&](auto&, Index images) { recipe.embed.batch = images; });
  set_cell_option("--colours", options.colours, [](auto& mark, const std::string& name) {
    watermark::use_colours(watermark::parse_mark_colours(name), mark);
  });
  if (options.perceptual > 0)
    read_option("--perceptual", [&] {
      auto& training = recipe.fusion().training;  // first: only some presets have it
      training.perceptual = load_perceptual_term(options.perceptual, options.vgg_weights, context);
    });
  return recipe;
}

void say_mark_psnr(const watermark::Owner& owner, Context& context) {
  char line[80];
  std::snprintf(line, sizeof line, "mark PSNR %.1f dB, chosen for this scene (--mark-psnr)\n",
                owner.options().mark_psnr);
  context.text() << line;
}

void say_cells(const watermark::Owner& owner, std::span<const watermark::CachedView> views,
               Context& context) {
  const Index side = owner.cells.side(), bits = owner.options().bits;
  const double shown = watermark::cells_shown(views, side);
  context.text() << side << " cells an axis: nine of ten views show " << std::lround(shown)
                 << " or more, for " << bits << " bits\n";
  if (shown < static_cast<double>(bits))
    context.note(
        "many views show fewer cells than the message has bits, and of one such view some bits are guesses: "
        "take fewer --bits, or read several views");
}

// Measures on views that the owner was not trained on.
Json measure_owner(const EmbedArguments& options, const watermark::Owner& owner, const Lpips<float>* lpips,
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

int run_embed(const EmbedArguments& options, Context& context) {
  const std::string checkpoint = options.out + ".checkpoint";
  const std::string image = options.image.empty() ? options.out + ".png" : options.image;
  if (std::filesystem::exists(options.out) && std::filesystem::equivalent(options.out, options.field))
    throw UsageError("--out: " + options.out + " is the field that is to be marked");
  if (std::filesystem::path(image).lexically_normal() ==
      std::filesystem::path(options.out).lexically_normal())
    throw UsageError("--image: " + image + " is the file of --out; name another file");
  check_writable(options.out);
  if (!options.resume) check_new_checkpoint(checkpoint);
  check_writable_page(image);
  for (const auto& name : options.under)
    read_option("--distort", [&] { return distort::parse_distortion(name); });
  std::optional<watermark::Message> intended;
  if (options.intended.given()) intended = message_of(options.intended, options.bits);
  const auto lpips = load_lpips(LpipsNetwork::alex, options.lpips_weights, context);
  const auto field = nerf::RadianceField::load(options.field);
  if (options.directions == "all" && !watermark::all_directions_for(field.space.kind))
    throw UsageError(
        "--directions: all is only for objects (away from the training cameras, other fields are "
        "blurred), " +
        options.field + " has space " + nerf::name_of(field.space.kind));
  const auto key = key_of(options, checkpoint);
  auto recipe = recipe_of(options, field, context);
  const auto views = cached_views(options, field, recipe, context);
  if (options.mark_psnr == 0) recipe.suit_mark_psnr(field, views);
  // Neither the checkpoint nor OWNER shall hold a key that is kept elsewhere.
  auto owner = recipe.make(field, options.no_key ? std::nullopt : std::optional(key), views);
  if (options.cells > 0) read_option("--cells", [&] { return owner.code(key); });  // enough for the message
  if (owner.mark().has_gain() && options.mark_psnr == 0) say_mark_psnr(owner, context);
  if (owner.mark().has_cells() && options.cells == 0) say_cells(owner, views, context);
  watermark::Embedder embedder(owner, views, recipe.embed);
  if (options.resume) embedder.restore(checkpoint);

  const InterruptGuard until_saved;  // Ctrl-C waits between the last step and the file
  RunLength length = options.length;
  length.seconds = recipe.embed.schedule.seconds;
  const double seconds = run_long(embedder, "embed", length, context, checkpoint);
  embedder.calibrate();
  if (embedder.steps() <= embedder.warm_steps())
    context.note("training ended in its warm start of " + std::to_string(embedder.warm_steps()) +
                 " steps: the mark is strong and hardly read; give it more --seconds");
  owner.save(options.out);
  owner.key = key;
  std::filesystem::remove(checkpoint);
  check_writable_page(image);  // a link may lead to the owner
  write_image(image, owner, context.seed());

  const auto sha256 = sha256_file_hex(options.out);
  const auto open = to_hex(watermark::public_key(key));
  context.text() << options.out << ": " << embedder.steps() << " steps in " << format_duration(seconds)
                 << (options.no_key ? ", holds no key: keep the file and the key secret" : ", keep it secret")
                 << "\nsha256 " << sha256 << "\npublic key " << open << "\n"
                 << image << ": unmarked, marked, ten times the difference\n";
  Json commitment = nullptr;
  if (intended) {
    commitment = watermark::commitment(sha256, key, *intended);
    context.text() << "commitment " << commitment.get<std::string>()
                   << ", to be time-stamped before the field is published\n";
  }
  Json json = measure_owner(options, owner, lpips ? &*lpips : nullptr, context);
  json["seconds"] = seconds;
  json["steps"] = embedder.steps();
  json["cells"] = owner.cells.side();
  const auto* fusion = std::get_if<watermark::FusionMarkOptions>(&recipe.mark);
  json["perceptual"] = fusion ? Json(fusion->training.perceptual.weight) : Json(nullptr);
  json["mark_psnr"] = owner.mark().has_gain() ? Json(owner.options().mark_psnr) : Json(nullptr);
  json["sha256"] = sha256;
  json["commitment"] = commitment;
  json["public_key"] = open;
  context.result(json);
  return kOk;
}

void add_view_options(CommandLine& app, EmbedArguments& o) {
  app.add_option("--views", o.views, "Views of the field to train on, 8 to 10000")
      ->range(8, 10000)
      ->type_name("N");
  app.add_option(
         "--distances", o.distances,
         "Distances of the training views. novel: novel cameras, the object as large as the extractor's "
         "image;\nnative: no larger than in the training images; several: also closer and farther cameras")
      ->one_of({"novel", "native", "several"})
      ->type_name("NAME");
  app.add_option(
         "--directions", o.directions,
         "Directions of the training views. all: every second view from cameras `sphere`, for objects;\n"
         "novel: only from novel cameras; default: all for objects with preset fast, else novel")
      ->one_of({"all", "novel"})
      ->type_name("NAME")
      ->default_str("");
  app.add_option("--samples", o.samples,
                 "Samples of the mark per ray, 1 to 64; default: 1, or 4 in scenes of type place")
      ->range(1, 64)
      ->type_name("N")
      ->default_str("");
  app.add_option("--batch", o.batch,
                 "Images per step, 1 to 64; default: 4, or 2 in scenes of type place; for preset fast")
      ->range(1, 64)
      ->type_name("N")
      ->default_str("");
}

void add_perceptual_term(CommandLine& app, EmbedArguments& o) {
  const auto weight =
      app.add_option(
             "--perceptual", o.perceptual,
             "Weight lambda of VGG-16 features in the content loss, 1e-6 to 100; 0.01 in the paper; default: "
             "no such term; for presets paper and code")
          ->range(1e-6, 100.0)
          ->type_name("F")
          ->default_str("");
  app.add_option("--vgg-weights", o.vgg_weights,
                 "VGG-16 weights under torchvision's names, from the first layer on; the deepest layer gives "
                 "the features; for --perceptual;\n"
                 "default: $FIELDMARK_DATA/weights/vgg16_conv1_1-conv2_2.safetensors")
      ->type_name("FILE")
      ->default_str("")
      ->needs(weight);
}

}  // namespace

Command add_embed(CommandLine& app) {
  auto o = std::make_shared<EmbedArguments>();
  app.add_option("--field", o->field, "Trained field to mark; the file is not changed")
      ->required()
      ->type_name("FIELD");
  app.add_option("--out", o->out, "Owner file to write; OWNER.checkpoint during training")
      ->required()
      ->type_name("OWNER");
  const auto key =
      app.add_option("--key", o->key, "Key from `fieldmark key`; default: a new one, kept in OWNER")
          ->type_name("KEY")
          ->default_str("");
  app.add_flag("--no-key", o->no_key,
               "Leave the key out of OWNER; commands that read or bake the mark then need --key")
      ->needs(key);
  app.add_option("--bits", o->bits, "Length in bits of the message that one view should show, 1 to 256")
      ->range(1, 256)
      ->type_name("N");
  add_message_options(app, o->intended, "Message whose commitment to print");
  app.add_option(
         "--preset", o->preset,
         "Method. fast: one bit per cell of the scene, trains in minutes;\npaper: one message everywhere, as "
         "in CopyRNeRF "
         "(Luo et al. 2023);\ncode: the same with networks like the authors' code's, without "
         "distortions")
      ->one_of({"fast", "paper", "code"})
      ->type_name("NAME");
  app.add_option(
         "--mark-psnr", o->mark_psnr,
         "Mark PSNR on the foreground in dB, 20 to 60; higher is fainter; default: 36.5, and up to 40 "
         "for objects with flat surfaces; for preset fast")
      ->range(20.0, 60.0)
      ->type_name("DB")
      ->default_str("");
  app.add_option(
         "--cells", o->cells,
         "Cells per axis of the scene's cube, 2 to 64; default: so many that nine of ten views show 400 "
         "cells and two per bit, in scenes of type place eight per bit; for preset fast")
      ->range(2, 64)
      ->type_name("N")
      ->default_str("");
  app.add_option("--reader-size", o->reader_size,
                 "Longer side of the extractor's images in pixels, 32 to 1024; default: 160, or 80 for "
                 "presets paper and code")
      ->range(32, 1024)
      ->type_name("N")
      ->default_str("");
  app.add_option("--colours", o->colours,
                 "Colours of the mark. light: brightness, like uneven lighting, least visible;\n"
                 "mixed: fine detail in a colour between blue and grey, read after less training;\n"
                 "blue: blue and yellow, lost in greyscale images;\n"
                 "default: mixed for objects, else light; for preset fast")
      ->one_of({"light", "blue", "mixed"})
      ->type_name("NAME")
      ->default_str("");
  add_view_options(app, *o);
  add_perceptual_term(app, *o);
  add_run_length(app, o->length, true, "300, or 2400 for presets paper and code");
  app.add_option("--measured-views", o->measured_views, "Novel views to measure at the end, 1 to 100000")
      ->range(1, 100000)
      ->type_name("N");
  app.add_option(
         "--distort", o->under,
         "Chain of distortions to measure as well, see `fieldmark distort --help`; not h264_A; repeatable")
      ->type_name("NAME[,NAME...]")
      ->default_str("");
  app.add_option(
         "--image", o->image,
         "PNG file to write, with four views unmarked, marked, and ten times the difference; default: "
         "OWNER.png")
      ->type_name("FILE")
      ->default_str("");
  add_lpips_weights(app, o->lpips_weights);
  app.add_flag("--resume", o->resume,
               "Resume from OWNER.checkpoint; repeat the options of the interrupted run");
  return [o](Context& context) { return run_embed(*o, context); };
}

}  // namespace fieldmark::cli
