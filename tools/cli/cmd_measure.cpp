#include <fieldmark/nerf/evaluation.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/measured.h"
#include "cli/perceptual.h"
#include "cli/scene_data.h"

namespace fieldmark::cli {
namespace {

struct Options {
  std::string owner, field, message, data, lpips_weights;
  std::string cameras = "near";
  Index count = 200, size = 0;
  std::vector<std::string> under;
};

std::vector<nerf::Camera> cameras_of(const Options& options, const watermark::Owner& owner,
                                     Context& context) {
  if (options.cameras != "test")
    return nerf::make_cameras(owner.field.cameras, nerf::parse_camera_set(options.cameras), options.count,
                              options.size, context.seed());
  if (options.data.empty()) throw UsageError("--cameras test: needs --data DIR, whose test views they are");
  std::vector<nerf::Camera> cameras;
  for (const auto& view : load_scene(options.data, {.split = "test"}, context).views)
    cameras.push_back(view.camera.scaled(options.size));
  return cameras;
}

// Against the photographs, a figure apart from those against the unmarked field.
nerf::Evaluation against_photographs(const Options& options, const nerf::RadianceField& field,
                                     const char* what, Context& context) {
  const auto data = load_scene(
      options.data, {.split = "test", .size = options.size, .background = field.background}, context);
  nerf::Renderer renderer(field);
  const InterruptGuard guard;
  Progress progress = context.progress(what);
  return nerf::evaluate(renderer, data, [&](Index done, Index total) {
    if (guard.interrupted()) throw Interrupted("the measurement is not complete");
    progress.update(static_cast<double>(done) / static_cast<double>(total));
    return true;
  });
}

int run(const Options& options, Context& context) {
  for (const auto& name : options.under) read_option("--under", [&] { return distort::parse_attack(name); });
  const auto lpips = load_lpips(LpipsNetwork::alex, options.lpips_weights, context);
  const auto owner = watermark::Owner::load(options.owner);
  std::optional<nerf::RadianceField> baked;
  std::optional<watermark::Message> message;
  if (!options.field.empty()) {
    message = read_option("--message",
                          [&] { return watermark::message_from_hex(options.message, owner.options().bits); });
    baked.emplace(nerf::RadianceField::load(options.field));
  }
  const auto measured = run_measure(owner, baked ? &*baked : nullptr, message ? &*message : nullptr,
                                    {.cameras = cameras_of(options, owner, context),
                                     .under = options.under,
                                     .seed = context.seed(),
                                     .lpips = lpips ? &*lpips : nullptr,
                                     .progress = {}},
                                    context);
  print_measurement(context.text(), measured, options.cameras);
  Json json = measurement_json(measured, options.cameras);
  if (baked && !options.data.empty()) {
    const double marked = against_photographs(options, *baked, "photographs", context).psnr;
    const double unmarked = against_photographs(options, owner.field, "photographs, unmarked", context).psnr;
    char line[120];
    std::snprintf(line, sizeof line, "against photographs  %.2f dB, unmarked field %.2f dB\n", marked,
                  unmarked);
    context.text() << line;
    json["psnr_photo"] = number(marked);
    json["psnr_photo_unmarked"] = number(unmarked);
  }
  context.result(json);
  return kOk;
}

}  // namespace

Command add_measure(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--owner", o->owner, "What `fieldmark embed` wrote")->required()->type_name("OWNER");
  CLI::Option* field = app.add_option("--field", o->field, "A baked field (the mark as trained, not baked)")
                           ->type_name("BAKED")
                           ->default_str("");
  CLI::Option* message =
      app.add_option("--message", o->message, "The message baked into it")->type_name("HEX");
  field->needs(message);
  message->needs(field);
  app.add_option("--cameras", o->cameras,
                 "near (drawn from the span of the training cameras),\n"
                 "ring (30 degrees above, radius 4.0311), sphere (all directions), test (of --data)")
      ->check(CLI::IsMember({"near", "ring", "sphere", "test"}).description(""))
      ->type_name("SET");
  app.add_option("--count", o->count, "Views, 1 to 100000; each with its own random message if not baked")
      ->check(CLI::Range(1, 100000).description(""))
      ->type_name("N");
  app.add_option("--size", o->size, "Pixels of the views' longer side, 16 to 8192 (as trained)")
      ->check(CLI::Range(16, 8192).description(""))
      ->type_name("N")
      ->default_str("");
  app.add_option("--under", o->under, "Distortions to measure under besides none (see attack), several times")
      ->type_name("NAME")
      ->default_str("");
  app.add_option("--data", o->data, "Data set for psnr_photo of a baked field and for --cameras test")
      ->type_name("DIR");
  add_lpips_weights(app, o->lpips_weights);
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
