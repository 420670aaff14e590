#include <fieldmark/nerf/evaluation.h>

#include <cstdio>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/lpips.h"
#include "cli/refinement.h"
#include "cli/scene_data.h"
#include "cli/supersampling.h"

namespace fieldmark::cli {
namespace {

struct EvalArguments {
  std::string field, data, lpips_weights;
  std::string split = "test";
  Index size = 0, supersampling = 0;
  bool refine_poses = false;
};

int run_eval(const EvalArguments& options, Context& context) {
  const auto field = nerf::RadianceField::load(options.field);
  auto data = load_scene(
      options.data, {.split = options.split, .size = options.size, .background = field.background}, context);
  const Json motion = options.refine_poses ? fit_cameras(field, data, context) : Json();
  const auto lpips = load_lpips(LpipsNetwork::alex, options.lpips_weights, context);
  const Index rays = options.supersampling > 0 ? options.supersampling : field.options().supersampling;
  nerf::Renderer renderer(field, {.supersampling = rays});
  const InterruptGuard guard;
  nerf::Evaluation evaluation;
  {
    Progress progress = context.progress("eval");
    evaluation = nerf::evaluate(
        renderer, data,
        [&](Index done, Index total) {
          progress.update(static_cast<double>(done) / static_cast<double>(total));
          return !guard.interrupted();
        },
        lpips ? &*lpips : nullptr);
  }
  if (guard.interrupted()) throw Interrupted("nothing was written");
  Json views = Json::array();
  const auto add = [&](const std::string& name, double psnr, double foreground, double fitted, double ssim,
                       double distance) {
    char line[160];
    std::snprintf(line, sizeof line, "%-16s %6.2f dB  foreground %6.2f dB  colour-fitted %6.2f dB  ssim %.4f",
                  name.c_str(), psnr, foreground, fitted, ssim);
    context.text() << line;
    if (lpips) {
      std::snprintf(line, sizeof line, "  lpips %.4f", distance);
      context.text() << line;
    }
    context.text() << "\n";
  };
  for (std::size_t i = 0; i < evaluation.per_view.size(); ++i) {
    const nerf::ViewScore& score = evaluation.per_view[i];
    add(data.views[i].name, score.psnr, score.psnr_foreground, score.psnr_colour_fitted, score.ssim,
        score.lpips);
    views.push_back({{"image", data.views[i].name},
                     {"psnr", number(score.psnr)},
                     {"psnr_foreground", number(score.psnr_foreground)},
                     {"psnr_colour_fitted", number(score.psnr_colour_fitted)},
                     {"ssim", number(score.ssim)},
                     {"lpips_alex", number(score.lpips)}});
  }
  add("mean", evaluation.psnr, evaluation.psnr_foreground, evaluation.psnr_colour_fitted, evaluation.ssim,
      evaluation.lpips);
  context.result({{"psnr", number(evaluation.psnr)},
                  {"psnr_foreground", number(evaluation.psnr_foreground)},
                  {"psnr_colour_fitted", number(evaluation.psnr_colour_fitted)},
                  {"camera_motion", motion},
                  {"ssim", number(evaluation.ssim)},
                  {"lpips_alex", number(evaluation.lpips)},
                  {"views", evaluation.views},
                  {"supersampling", rays},
                  {"scene", data.name},
                  {"split", data.split},
                  {"seconds_per_view", evaluation.seconds_per_view},
                  {"per_view", views}});
  return kOk;
}

}  // namespace

Command add_eval(CommandLine& app) {
  auto o = std::make_shared<EvalArguments>();
  app.add_option("--field", o->field, "Field to evaluate")->required()->type_name("FIELD");
  app.add_option("--data", o->data, "Data set to compare with, a folder as `fieldmark train --data` takes")
      ->required()
      ->type_name("DIR");
  app.add_option("--split", o->split, "Part of the data set: train, val, test")
      ->one_of({"train", "val", "test"})
      ->type_name("SPLIT");
  app.add_option("--size", o->size, "Longer side of the images in pixels, 16 to 8192; default: original size")
      ->range(16, 8192)
      ->type_name("N")
      ->default_str("");
  app.add_flag("--refine-poses", o->refine_poses,
               "Align each camera with its image first, with the field frozen; for fields of preset hash");
  add_supersampling(app, o->supersampling);
  add_lpips_weights(app, o->lpips_weights);
  return [o](Context& context) { return run_eval(*o, context); };
}

}  // namespace fieldmark::cli
