#include <fieldmark/nerf/collapse_watch.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/field_sizing.h>
#include <fieldmark/nerf/psnr_target.h>
#include <fieldmark/nerf/trainer.h>

#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/long_run.h"
#include "cli/precision.h"
#include "cli/refinement.h"
#include "cli/scene_data.h"

namespace fieldmark::cli {
namespace {

constexpr double kSizing = 1. / 3;  // of --seconds, at most

struct TrainArguments {
  std::string data, out;
  std::string preset = "hash", model = "fixed", background, precision = "fp32", scene_type;
  Index size = 0, supersampling = 1;
  RunLength length;
  double target_psnr = 0, max_megabytes = 0;
  Refinement refinement;
  bool resume = false, no_carve = false;
};

std::optional<nerf::Background> background_of(const std::string& name) {
  if (name.empty()) return std::nullopt;
  return name == "white" ? nerf::Background::white : nerf::Background::black;
}

nerf::RadianceFieldOptions fitted(const nerf::RadianceFieldOptions& field, double max_megabytes) {
  if (max_megabytes <= 0) return field;
  if (const auto fit = nerf::fit_field(field, max_megabytes * 1e6)) return *fit;
  throw UsageError("--max-megabytes: no field is as small as " + std::to_string(max_megabytes) + " MB");
}

// Finds the size that the scene needs with short trainings, whose figures go into the result. A timed run
// spends at most kSizing of its seconds on them; a resumed run has its sizes in its checkpoint.
nerf::RadianceFieldOptions sized(const nerf::RadianceFieldOptions& start, const nerf::Dataset& data,
                                 const RunLength& length, Json& report, Context& context) {
  const InterruptGuard guard;
  const double begun = context.seconds();
  const double most = length.steps > 0 ? std::numeric_limits<double>::infinity() : kSizing * length.seconds;
  nerf::FieldSizing sizing;
  {
    Progress progress = context.progress("sizing");
    sizing = nerf::size_field(
        data, start, {.most_log2_table = std::max(start.field.encoding.log2_table, 9), .seed = start.seed},
        [&](Index done, Index total) {
          progress.update(static_cast<double>(done) / static_cast<double>(total));
          return context.seconds() - begun < most && !guard.interrupted();
        });
  }
  if (guard.interrupted()) throw Interrupted("while the model was sized, nothing was written");
  Json trials = Json::array();
  for (const nerf::SizingTrial& t : sizing.trials) {
    char line[160];
    std::snprintf(line, sizeof line, "  %-28s %9lld parameters %6.2f dB  %s\n", t.what.c_str(),
                  static_cast<long long>(t.parameters), t.psnr, t.kept ? "taken" : "not taken");
    context.text() << line;
    trials.push_back({{"what", t.what}, {"parameters", t.parameters}, {"psnr", t.psnr}, {"taken", t.kept}});
  }
  const nerf::FieldOptions& f = sizing.field.field;
  const double seconds = context.seconds() - begun;
  char line[80];
  std::snprintf(line, sizeof line, "  sized in %.1f s\n", seconds);
  context.text() << line;
  if (!sizing.compared)
    context.text() << "  too short to compare tables: the model stays as it is without --model sized\n";
  report = {{"seconds", seconds},
            {"pixels", sizing.pixels},
            {"trials", trials},
            {"levels", f.encoding.levels},
            {"log2_table", f.encoding.log2_table},
            {"finest_resolution", f.encoding.finest_resolution},
            {"width", f.width},
            {"directional", f.directional},
            {"occupancy", sizing.field.occupancy}};
  return sizing.field;
}

// Loads the training images and prints the type of their scene.
nerf::Dataset training_data(const TrainArguments& options, Context& context) {
  nerf::DatasetOptions wanted{
      .split = "train", .size = options.size, .background = background_of(options.background)};
  if (!options.scene_type.empty()) wanted.scene = nerf::parse_scene_type(options.scene_type);
  try {
    nerf::Dataset data = load_scene(options.data, wanted, context);
    context.text() << "scene type " << nerf::name_of(data.scene) << ": " << data.scene_reason
                   << (wanted.scene ? "" : "; --scene-type overrides") << "\n";
    return data;
  } catch (const ValueError& e) {
    if (!wanted.scene) throw;
    throw UsageError("--scene-type " + options.scene_type + ": " + e.what());
  }
}

// Returns the options to load another split of the same scene.
nerf::DatasetOptions other_split(const TrainArguments& options, const nerf::Dataset& train,
                                 const char* split) {
  return {.split = split, .size = options.size, .background = train.background, .scene = train.scene};
}

nerf::PsnrTarget psnr_target(const TrainArguments& options, const nerf::RadianceField& field,
                             const nerf::Dataset& train, Context& context) {
  std::optional<nerf::Dataset> held_out;
  if (options.target_psnr > 0 && nerf::has_split(options.data, "val"))
    held_out = load_scene(options.data, other_split(options, train, "val"), context);
  return {field, options.target_psnr, std::move(held_out)};
}

// Takes a few images that are not trained on, or training images if there are no others.
nerf::CollapseWatch collapse_watch(const TrainArguments& options, const nerf::RadianceField& field,
                                   const nerf::Dataset& train) {
  for (const char* split : {"val", "test"}) {
    if (!nerf::has_split(options.data, split)) continue;
    nerf::DatasetOptions few = other_split(options, train, split);
    few.most_views = nerf::CollapseWatch::kViews;
    try {
      return {field, nerf::load_dataset(options.data, few)};
    } catch (const Error&) {
      continue;  // training does not need them
    }
  }
  return {field, train};
}

void require_healthy(const std::string& fault, const nerf::Dataset& data, const nerf::Trainer& trainer) {
  if (fault.empty()) return;
  throw Error(
      "training collapsed after " + std::to_string(trainer.steps()) + " steps: " + fault +
      "; no field was written. The scene was taken for type " + nerf::name_of(data.scene) + " (" +
      data.scene_reason +
      "): if that is wrong, choose another with --scene-type; else check that cameras and images belong "
      "together");
}

// PSNR on the data set's test views, measured after everything is saved; null without test views.
struct TestScores {
  Json psnr, foreground, colour_fitted, pose_fitted;
};

nerf::Evaluation evaluated(const nerf::RadianceField& field, const nerf::Dataset& data, Context& context) {
  nerf::Renderer renderer(field);
  const InterruptGuard guard;
  Progress progress = context.progress("test views");
  const auto evaluation = nerf::evaluate(renderer, data, [&](Index done, Index total) {
    progress.update(static_cast<double>(done) / static_cast<double>(total));
    return !guard.interrupted();
  });
  if (guard.interrupted())
    throw Interrupted("the field is complete; `fieldmark eval` measures its test views, which are not");
  return evaluation;
}

// Loads the test views of a field that is already saved.
nerf::Dataset test_views(const TrainArguments& options, const nerf::Dataset& train, Context& context) try {
  return load_scene(options.data, other_split(options, train, "test"), context);
} catch (const Error& e) {
  throw Error(options.out + " is complete, but its test views cannot be measured: " + e.what());
}

// @param surveyed  the training views, none of which should be a test view
TestScores test_scores(const TrainArguments& options, const nerf::RadianceField& field,
                       const nerf::Dataset& train, const std::vector<nerf::SurveyedView>& surveyed,
                       Json& warnings, Context& context) {
  if (!nerf::has_split(options.data, "test")) {
    context.note(options.data + " has no test images, so no PSNR is measured on them");
    return {};
  }
  auto data = test_views(options, train, context);
  warn_of(nerf::twins(surveyed, nerf::survey_views(data)), warnings, context);
  const nerf::Evaluation plain = evaluated(field, data, context);
  TestScores scores{.psnr = plain.psnr,
                    .foreground = number(plain.psnr_foreground),
                    .colour_fitted = plain.psnr_colour_fitted,
                    .pose_fitted = {}};
  if (options.refinement.poses) {
    fit_cameras(field, data, context);
    const nerf::Evaluation fitted = evaluated(field, data, context);
    scores.colour_fitted = fitted.psnr_colour_fitted;
    scores.pose_fitted = fitted.psnr;
  }
  return scores;
}

void check_preset(const TrainArguments& options) {
  check_refinement(options.refinement, options.preset);
  if (options.no_carve && options.refinement.poses)
    throw UsageError("--no-carve: --refine-poses never carves");
  if (options.preset != "mlp") return;
  if (options.model == "sized") throw UsageError("--model sized: the mlp preset has one size");
  if (options.supersampling > 1)
    throw UsageError("--supersampling: the mlp preset trains with one ray through a pixel's centre");
}

// Refuses or names options that have no effect on this scene.
void check_scene(const TrainArguments& options, const nerf::Dataset& data, Context& context) {
  if (options.preset == "mlp" && data.scene == nerf::SceneType::place)
    throw UsageError(
        "--preset mlp: its samples are spread over straight rays, and a scene of type place has no bounds; "
        "use --preset hash");
  if (options.no_carve && data.scene != nerf::SceneType::object && data.scene != nerf::SceneType::plain)
    context.note("--no-carve: only objects have silhouettes, this scene is of type " +
                 std::string(nerf::name_of(data.scene)));
}

// Returns the sizes of the field; `sizing` receives the trials of --model sized.
nerf::RadianceFieldOptions field_sizes(const TrainArguments& options, const nerf::Dataset& data,
                                       const std::string& checkpoint, Json& sizing, Context& context) {
  nerf::RadianceFieldOptions sizes;
  if (options.preset == "mlp")
    sizes.field.kind = nerf::FieldKind::mlp;
  else
    sizes = nerf::field_options({.steps = options.length.steps, .seconds = options.length.seconds});
  sizes.seed = context.seed();
  sizes = fitted(sizes, options.max_megabytes);
  if (options.model == "sized") {
    sizes = options.resume
                ? nerf::checkpointed_field(checkpoint)
                : fitted(sized(sizes, data, options.length, sizing, context), options.max_megabytes);
    sizes.seed = context.seed();
  }
  sizes.supersampling = options.supersampling;
  return sizes;
}

nerf::TrainOptions training_options(const TrainArguments& options, const nerf::RadianceField& field,
                                    bool exposures, const Context& context) {
  nerf::TrainOptions o = nerf::train_options(field.options().field.kind);
  o.schedule.steps = options.length.steps;
  o.schedule.seconds = options.length.seconds;
  o.seed = context.seed();
  o.precision = precision_of(options.precision);
  o.carve = !options.no_carve;
  o.image_colours = exposures;
  o.refine_poses = options.refinement.poses;
  return o;
}

void say_trained(const std::string& out, const nerf::Trainer& trainer, double seconds, const Json& psnr,
                 Context& context) {
  char line[200];
  std::snprintf(line, sizeof line, ": %lld steps%s in %.1f s, %.2f MB",
                static_cast<long long>(trainer.steps()), trainer.replanned() ? " (schedule revised)" : "",
                seconds, static_cast<double>(std::filesystem::file_size(out)) / 1e6);
  context.text() << out << line;
  if (!psnr.is_null()) {
    std::snprintf(line, sizeof line, ", %.2f dB on the test views", psnr.get<double>());
    context.text() << line;
  }
  context.text() << "\n";
}

int run_train(const TrainArguments& options, Context& context) {
  const std::string checkpoint = options.out + ".checkpoint";
  check_preset(options);
  check_writable(options.out);
  if (!options.resume) check_new_checkpoint(checkpoint);
  if (options.refinement.poses) check_writable_page(cameras_file(options.out));
  const nerf::Dataset data = training_data(options, context);
  check_scene(options, data, context);
  const std::vector<nerf::SurveyedView> surveyed = nerf::survey_views(data);
  Json warnings = Json::array();
  warn_of(nerf::odd_views(surveyed, data.scene), warnings, context);
  warn_of(nerf::odd_files(options.data, options.size), warnings, context);
  Json sizing, exposure;
  nerf::RadianceField field(field_sizes(options, data, checkpoint, sizing, context));
  const auto held_out = [&]() -> std::optional<nerf::Dataset> {
    if (!nerf::has_split(options.data, "val")) return {};
    return load_scene(options.data, other_split(options, data, "val"), context);
  };
  const bool exposures = wants_exposures(options.refinement, data, held_out, field.options(),
                                         options.resume ? checkpoint : "", exposure, context);
  nerf::Trainer trainer(field, data, training_options(options, field, exposures, context));
  if (options.resume) trainer.restore(checkpoint);
  if (trainer.from_earlier_version())
    context.note(checkpoint +
                 ": a checkpoint of version 0.1, which knows its data set by name and size alone");

  nerf::PsnrTarget target = psnr_target(options, field, data, context);
  nerf::CollapseWatch watch = collapse_watch(options, field, data);
  const double begun = context.seconds(), samples_before = trainer.samples();
  const InterruptGuard until_saved;  // Ctrl-C waits between the last step and the file
  const double seconds = run_long(trainer, "train", options.length, context, checkpoint, [&] {
    require_healthy(watch.look(trainer.steps(), trainer.train_psnr(), context.seconds()), data, trainer);
    return target.reached(trainer.steps(), trainer.train_psnr());
  });
  const double trained = context.seconds() - begun;  // without the runs that this one resumes
  require_healthy(watch.verdict(trainer.steps()), data, trainer);
  field.save(options.out);
  Json motion;
  if (options.refinement.poses) motion = save_cameras(options.out, data, trainer.cameras(), context);
  std::filesystem::remove(checkpoint);

  const TestScores scores = test_scores(options, field, data, surveyed, warnings, context);
  say_trained(options.out, trainer, seconds, scores.psnr, context);
  Json result{{"test_psnr", scores.psnr},
              {"test_psnr_foreground", scores.foreground},
              {"test_psnr_colour_fitted", scores.colour_fitted},
              {"exposure", exposures ? "on" : "off"},
              {"scene_type", nerf::name_of(data.scene)},
              {"scene_type_reason", data.scene_reason},
              {"train_seconds", seconds},
              {"steps", trainer.steps()},
              {"replanned", trainer.replanned()},
              {"samples_per_second", (trainer.samples() - samples_before) / trained},
              {"parameters", field.params.parameters()},
              {"file_bytes", std::filesystem::file_size(options.out)},
              {"warnings", warnings}};
  if (!sizing.is_null()) result["sizing"] = sizing;
  if (!exposure.is_null()) result["exposure_trial"] = exposure;
  if (options.refinement.poses) {
    result["test_psnr_pose_fitted"] = scores.pose_fitted;
    result["camera_motion"] = motion;
  }
  context.result(result);
  return kOk;
}

}  // namespace

Command add_train(CommandLine& app) {
  auto o = std::make_shared<TrainArguments>();
  app.add_option(
         "--data", o->data,
         "Data set to train on: folder with transforms_*.json, transforms.json, poses_bounds.npy or a COLMAP "
         "model")
      ->required()
      ->type_name("DIR");
  app.add_option("--out", o->out, "Field file to write; FIELD.checkpoint during training")
      ->required()
      ->type_name("FIELD");
  app.add_option("--size", o->size,
                 "Longer side of the training images in pixels, 16 to 8192; default: original size")
      ->range(16, 8192)
      ->type_name("N")
      ->default_str("");
  app.add_option("--preset", o->preset,
                 "Kind of field. hash: multiresolution hash grid with small networks;\n"
                 "mlp: original NeRF, coarse and fine networks of 8 layers of 256 units")
      ->one_of({"hash", "mlp"})
      ->type_name("NAME");
  app.add_option("--model", o->model,
                 "Size of the model. fixed: by the length of the run;\n"
                 "sized: by short trainings on the scene; for preset hash")
      ->one_of({"fixed", "sized"})
      ->type_name("NAME");
  app.add_option(
         "--supersampling", o->supersampling,
         "Rays per side of a pixel, 1, 2, 4 or 8, in training after 8000 steps and in every later render;\n"
         "for preset hash")
      ->one_of({1, 2, 4, 8})
      ->type_name("N");
  add_run_length(app, o->length, true);
  add_precision(app, o->precision);
  app.add_option("--target-psnr", o->target_psnr,
                 "End training at this PSNR in dB, 1 to 100, of 4 validation images every 250 steps, "
                 "or of the training rays if there are no validation images; default: off")
      ->range(1.0, 100.0)
      ->type_name("DB")
      ->default_str("");
  app.add_option(
         "--background", o->background,
         "Colour behind transparent pixels: white, black; default: white for objects in the Blender layout;\n"
         "whichever is closer to a plain background; otherwise black")
      ->one_of({"white", "black"})
      ->type_name("COLOUR")
      ->default_str("");
  app.add_option(
         "--scene-type", o->scene_type,
         "Type of scene. object: silhouettes in the images' alpha; plain: opaque object before one "
         "colour; place: scene with a background; forward: cameras that look one way, with depth bounds;\n"
         "default: decided from images and cameras")
      ->one_of(nerf::scene_type_names())
      ->type_name("TYPE")
      ->default_str("");
  app.add_option("--max-megabytes", o->max_megabytes,
                 "Largest file size of the field in MB, 0.1 to 100000; default: no limit")
      ->range(0.1, 1e5)
      ->type_name("M")
      ->default_str("");
  add_refinement(app, o->refinement);
  app.add_flag("--no-carve", o->no_carve, "Keep samples outside the silhouettes; for images with alpha");
  app.add_flag("--resume", o->resume,
               "Resume from FIELD.checkpoint; repeat the options of the interrupted run");
  return [o](Context& context) { return run_train(*o, context); };
}

}  // namespace fieldmark::cli
