#include <fieldmark/engine/random.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/refined_cameras.h>
#include <fieldmark/tools/bench/captures_bench.h>

#include <Eigen/Geometry>
#include <limits>
#include <numbers>

#include "training_loop.h"

namespace fieldmark::bench {
namespace {

using Vector = Eigen::Vector3d;
using PoseMap = Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>;

// Returns a direction that is uniform on the sphere.
Vector direction(const CounterRng& rng, std::uint64_t n) {
  const double z = 2 * rng.uniform(2 * n) - 1, angle = 2 * std::numbers::pi * rng.uniform(2 * n + 1);
  const double radius = std::sqrt(1 - z * z);
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

double distance_to_scene(const nerf::View& view, const nerf::Vec3& centre) {
  if (view.depth) return 2 / (1 / view.depth->near + 1 / view.depth->far);
  const nerf::Vec3 p = view.camera.position();
  return (Vector(p.data()) - Vector(centre.data())).norm();
}

// Trains a variant; `centre` receives the middle of the scene.
CaptureRow trained(const nerf::Dataset& train, const nerf::Dataset& test, const CaptureVariant& variant,
                   const CaptureRun& run, nerf::Vec3& centre, const std::function<void(double)>& progress) {
  const ScheduleOptions schedule{.seconds = run.seconds};
  nerf::RadianceFieldOptions sizes = nerf::field_options(schedule);
  sizes.seed = run.seed;
  nerf::RadianceField field(sizes);
  const nerf::TrainOptions options{.schedule = schedule,
                                   .seed = run.seed,
                                   .carve = false,
                                   .image_colours = variant.exposures,
                                   .refine_poses = variant.refined};
  nerf::Trainer trainer(field, train, options);
  train_to_end(trainer, schedule, progress);
  const nerf::Bounds& b = field.space.bounds;
  for (std::size_t k = 0; k < 3; ++k) centre[k] = b.corner[k] + b.side / 2;
  CaptureRow row{.variant = variant, .steps = trainer.steps()};
  nerf::Renderer renderer(field);
  const auto still_there = [&](Index, Index) {
    progress(1);
    return true;
  };
  const nerf::Evaluation plain = nerf::evaluate(renderer, test, still_there);
  row.psnr = plain.psnr;
  row.psnr_colour_fitted = plain.psnr_colour_fitted;
  nerf::Dataset fitted = test;
  const auto cameras =
      nerf::fit_cameras(field, test, {.steps = run.fit_steps, .seed = run.seed}, still_there);
  for (std::size_t v = 0; v < cameras.size(); ++v) fitted.views[v].camera = cameras[v];
  row.psnr_pose_fitted = nerf::evaluate(renderer, fitted, still_there).psnr;
  return row;
}

const CaptureRow& row_with(const std::vector<CaptureRow>& rows, bool jittered, bool refined) {
  for (const CaptureRow& row : rows)
    if (!row.variant.exposures && row.variant.jittered == jittered && row.variant.refined == refined)
      return row;
  throw ValueError("[recovered] rows must have every variant of run_captures_bench()");
}

}  // namespace

void jitter_cameras(nerf::Dataset& data, const PoseJitter& jitter, const nerf::Vec3& centre) {
  const CounterRng rng(jitter.seed);
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    PoseMap pose(data.views[v].camera.pose.data());
    const double distance = distance_to_scene(data.views[v], centre);
    const Eigen::AngleAxisd turn(jitter.degrees * std::numbers::pi / 180, direction(rng, 2 * v));
    pose.leftCols<3>() = (turn.toRotationMatrix() * pose.leftCols<3>()).eval();
    pose.col(3) += jitter.part * distance * direction(rng, 2 * v + 1);
  }
}

std::vector<CaptureVariant> capture_variants() {
  return {{.name = "as captured"},
          {.name = "exposures learnt", .exposures = true},
          {.name = "poses refined", .refined = true},
          {.name = "exposures learnt, poses refined", .exposures = true, .refined = true},
          {.name = "jittered", .jittered = true},
          {.name = "jittered, poses refined", .refined = true, .jittered = true}};
}

std::vector<CaptureRow> run_captures_bench(const nerf::Dataset& train, const nerf::Dataset& test,
                                           const CaptureRun& run, const PoseJitter& jitter,
                                           const std::function<void(const std::string&, double)>& progress) {
  const auto variants = capture_variants();
  std::vector<CaptureRow> rows;
  nerf::Vec3 centre{};
  nerf::Dataset moved = train;
  for (const CaptureVariant& variant : variants) {
    const auto told = [&](double part) {
      if (progress)
        progress(variant.name,
                 (static_cast<double>(rows.size()) + part) / static_cast<double>(variants.size()));
    };
    rows.push_back(trained(variant.jittered ? moved : train, test, variant, run, centre, told));
    if (rows.size() == 1) jitter_cameras(moved, jitter, centre);
  }
  return rows;
}

double lost(const std::vector<CaptureRow>& rows, double CaptureRow::*psnr) {
  return row_with(rows, false, false).*psnr - row_with(rows, true, false).*psnr;
}

double recovered(const std::vector<CaptureRow>& rows, double CaptureRow::*psnr) {
  const double jittered = row_with(rows, true, false).*psnr, refined = row_with(rows, true, true).*psnr;
  const double whole = lost(rows, psnr);
  return whole > 0 ? (refined - jittered) / whole : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace fieldmark::bench
