#include "cli/training_attack.h"

#include <fieldmark/nerf/rendered_dataset.h>
#include <fieldmark/nerf/trainer.h>
#include <fieldmark/watermark/attacks/extractor_attack.h>

#include <cstdio>

#include "cli/cli.h"
#include "cli/scene_data.h"

namespace fieldmark::cli {
namespace {

// Calls make(callback after each view), with progress under this name.
template <class F>
nerf::Dataset with_progress(const char* name, Context& context, F make) {
  const InterruptGuard guard;
  Progress progress = context.progress(name);
  return make([&](Index done, Index total) {
    if (guard.interrupted()) throw Interrupted("nothing was written");
    progress.update(static_cast<double>(done) / static_cast<double>(total));
    return true;
  });
}

nerf::Dataset renders(const nerf::RadianceField& field, const TrainingAttackOptions& options,
                      Context& context) {
  const auto cameras = nerf::make_cameras(field.cameras, nerf::CameraSet::novel, options.views, options.size,
                                          context.seed() + 61);
  return with_progress("renders", context,
                       [&](auto tell) { return nerf::rendered_dataset(field, cameras, tell); });
}

nerf::Dataset turned_renders(const nerf::RadianceField& field, const TrainingAttackOptions& options,
                             Context& context) {
  const auto owner = watermark::Owner::load(options.owner);
  return with_progress("against the extractor", context, [&](auto tell) {
    return watermark::renders_against_extractor(
        owner, field, options.views, {.mark_psnr = options.mark_psnr, .seed = context.seed() + 63}, tell);
  });
}

nerf::Dataset data_of(const std::string& name, const nerf::RadianceField& field,
                      const TrainingAttackOptions& options, Context& context) {
  if (name == "finetune")
    return load_scene(options.data, {.split = "train", .size = options.size, .background = field.background},
                      context);
  return name == "remove" ? turned_renders(field, options, context) : renders(field, options, context);
}

// Returns the sizes of the field that retrain trains.
nerf::RadianceFieldOptions retrained_sizes(const nerf::RadianceField& field,
                                           const TrainingAttackOptions& options) {
  const nerf::FieldKind attacked = field.options().field.kind;
  if (options.preset.empty() || (options.preset == "mlp") == (attacked == nerf::FieldKind::mlp))
    return field.options();
  if (options.preset == "hash")
    return nerf::field_options({.steps = options.length.steps, .seconds = options.length.seconds});
  if (field.space.kind == nerf::SpaceKind::contracted)
    throw UsageError(
        "--preset mlp: its samples are spread over straight rays, and the scene of this field has no bounds; "
        "use --preset hash");
  nerf::RadianceFieldOptions sizes;
  sizes.field.kind = nerf::FieldKind::mlp;
  return sizes;
}

nerf::RadianceField start(const std::string& name, const nerf::RadianceField& field,
                          const TrainingAttackOptions& options, Context& context) {
  if (name != "retrain") return field;
  if (field.space.kind == nerf::SpaceKind::ndc)
    throw UsageError(
        "--attack retrain: a forward-facing field's images do not say how near its scene begins");
  nerf::RadianceFieldOptions sizes = retrained_sizes(field, options);
  sizes.seed = context.seed() + 62;
  return nerf::RadianceField(sizes);
}

// Trains until the run is done.
void train(const std::string& name, nerf::Trainer& trainer, const RunLength& length, Context& context,
           Json& result) {
  const double seconds = run_long(trainer, name, length, context);
  result["steps"] = trainer.steps();
  result["seconds"] = seconds;
  result["psnr_trained"] = number(trainer.train_psnr());
}

}  // namespace

void add_training_attack(CommandLine& app, TrainingAttackOptions& o) {
  app.add_option("--data", o.data, "Data set of clean images; for finetune")->type_name("DIR");
  app.add_option("--owner", o.owner, "Owner file whose extractor the attacker holds; for remove")
      ->type_name("OWNER");
  app.add_option(
         "--mark-psnr", o.mark_psnr,
         "PSNR of the changed against the unchanged renders on the foreground in dB, 10 to 60; for remove")
      ->range(10.0, 60.0)
      ->type_name("DB");
  app.add_option(
         "--size", o.size,
         "Longer side of the training images in pixels, 16 to 8192; default: original size, of renders as "
         "trained; not for remove")
      ->range(16, 8192)
      ->type_name("N")
      ->default_str("");
  app.add_option("--views", o.views, "Views to render, 4 to 10000; for finetune-renders, remove and retrain")
      ->range(4, 10000)
      ->type_name("N");
  app.add_option(
         "--preset", o.preset,
         "Kind of the new field: hash, mlp; another kind than FIELD's has the sizes of `train --preset`;\n"
         "default: kind and sizes of FIELD; for retrain")
      ->one_of({"hash", "mlp"})
      ->type_name("NAME")
      ->default_str("");
  app.add_option("--lr", o.lr, "Initial learning rate, 1e-6 to 1; for finetune, finetune-renders and remove")
      ->range(1e-6, 1.0)
      ->type_name("F");
  add_run_length(app, o.length, false);
}

bool is_training_attack(const std::string& name) {
  return name == "finetune" || name == "finetune-renders" || name == "remove" || name == "retrain";
}

nerf::RadianceField run_training_attack(const std::string& name, const nerf::RadianceField& field,
                                        const TrainingAttackOptions& options, Context& context,
                                        Json& result) {
  if (name == "finetune" && options.data.empty()) throw UsageError("--attack finetune: needs --data DIR");
  if (name == "remove" && options.owner.empty()) throw UsageError("--attack remove: needs --owner OWNER");
  nerf::RadianceField out = start(name, field, options, context);
  const nerf::Dataset data = data_of(name, field, options, context);
  nerf::TrainOptions train_options = nerf::train_options(out.options().field.kind);
  train_options.keep = name != "retrain";
  if (train_options.keep) train_options.schedule.lr = options.lr;
  train_options.schedule.steps = options.length.steps;
  train_options.schedule.seconds = options.length.seconds;
  train_options.seed = context.seed();
  nerf::Trainer trainer(out, data, train_options);
  train(name, trainer, options.length, context, result);
  return out;
}

}  // namespace fieldmark::cli
