#include "cli/refinement.h"

#include <fieldmark/core/files.h>
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/nerf/exposure_trial.h>

#include <cstdio>
#include <ostream>

#include "cli/cli.h"

namespace fieldmark::cli {
namespace {

Json motion_of(const nerf::Dataset& data, const std::vector<nerf::Camera>& cameras, Context& context) {
  std::vector<nerf::Camera> given;
  for (const nerf::View& v : data.views) given.push_back(v.camera);
  const nerf::CameraMotion motion = nerf::mean_motion(given, cameras);
  char line[120];
  std::snprintf(line, sizeof line,
                "%zu %s cameras moved by %.3f degrees and %.4g units of length on average\n", cameras.size(),
                data.split.c_str(), motion.degrees, motion.distance);
  context.text() << line;
  return {{"degrees", motion.degrees}, {"distance", motion.distance}};
}

}  // namespace

void add_refinement(CommandLine& app, Refinement& refinement) {
  app.add_option("--exposure", refinement.exposure,
                 "Exposures of the training images. off: all have one;\n"
                 "on: learn exposure and white balance of each image;\n"
                 "auto (for preset hash): on if it gains 0.1 dB on validation images in two short trainings")
      ->one_of({"off", "on", "auto"})
      ->type_name("MODE");
  app.add_flag("--refine-poses", refinement.poses,
               "Refine the training cameras, for poses wrong by up to about 1 degree; writes\n"
               "FIELD.cameras.json; for preset hash");
}

void check_refinement(const Refinement& refinement, const std::string& preset) {
  if (preset != "mlp") return;
  if (refinement.poses)
    throw UsageError("--refine-poses: the mlp preset has no gradients in positions; use --preset hash");
  if (refinement.exposure == "auto")
    throw UsageError("--exposure auto: short trainings of the mlp preset tell nothing; choose on or off");
}

bool wants_exposures(const Refinement& refinement, const nerf::Dataset& train,
                     const std::function<std::optional<nerf::Dataset>()>& held_out,
                     const nerf::RadianceFieldOptions& field, const std::string& checkpoint, Json& report,
                     Context& context) {
  if (refinement.exposure != "auto") return refinement.exposure == "on";
  if (!checkpoint.empty()) return SafetensorsFile::read(checkpoint).has("image/colour");
  const auto images = held_out();
  if (!images) {
    context.note("--exposure auto: there are no validation images, so exposures stay off");
    return false;
  }
  const InterruptGuard guard;
  std::optional<nerf::ExposureTrial> trial;
  {
    Progress progress = context.progress("exposure");
    trial = nerf::try_exposures(train, *images, field, {.seed = field.seed}, [&](Index done, Index total) {
      progress.update(static_cast<double>(done) / static_cast<double>(total));
      return !guard.interrupted();
    });
  }
  if (!trial) throw Interrupted("while exposures were tried, nothing was written");
  char line[200];
  std::snprintf(
      line, sizeof line,
      "exposure %s: images differ by %.1f%%; %.2f dB with, %.2f dB without on %lld validation images after "
      "short trainings\n",
      trial->helps ? "on" : "off", 100 * trial->spread, trial->psnr_with, trial->psnr_without,
      static_cast<long long>(images->views.size()));
  context.text() << line;
  report = {
      {"psnr_with", trial->psnr_with}, {"psnr_without", trial->psnr_without}, {"spread", trial->spread}};
  return trial->helps;
}

std::string cameras_file(const std::string& field) { return field + ".cameras.json"; }

Json save_cameras(const std::string& field, const nerf::Dataset& data,
                  const std::vector<nerf::Camera>& cameras, Context& context) {
  write_file_atomically(cameras_file(field), nerf::format_transforms(data.views, cameras));
  return motion_of(data, cameras, context);
}

Json fit_cameras(const nerf::RadianceField& field, nerf::Dataset& data, Context& context) {
  if (field.coarse) throw UsageError("--refine-poses: only for fields trained with --preset hash");
  const InterruptGuard guard;
  std::vector<nerf::Camera> cameras;
  {
    Progress progress = context.progress("cameras");
    cameras = nerf::fit_cameras(field, data, {}, [&](Index done, Index total) {
      progress.update(static_cast<double>(done) / static_cast<double>(total));
      return !guard.interrupted();
    });
  }
  if (guard.interrupted()) throw Interrupted("while cameras were fitted");
  Json motion = motion_of(data, cameras, context);
  for (std::size_t v = 0; v < cameras.size(); ++v) data.views[v].camera = cameras[v];
  return motion;
}

}  // namespace fieldmark::cli
