#include <fieldmark/core/error.h>
#include <fieldmark/nerf/refined_cameras.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "rotation.h"

namespace fieldmark::nerf {
namespace {

constexpr Index kFitAsked = 16;  // steps between two calls of progress

void check_sizes(const char* op, std::size_t a, std::size_t b) {
  if (a != b)
    throw ShapeError("[" + std::string(op) + "] cameras must be as many as there are images, " +
                     std::to_string(a) + ", got " + std::to_string(b));
}

// From |R - S|^2 = 8 sin^2(angle / 2), which resolves small angles that a trace loses.
double degrees_between(const Pose& a, const Pose& b) {
  double square = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const Vec3 off = pose_column(a, c) - pose_column(b, c);
    square += dot(off, off);
  }
  return 2 * std::asin(std::min(1., std::sqrt(square / 8))) * 180 / std::numbers::pi;
}

}  // namespace

std::vector<Camera> fit_cameras(const RadianceField& field, const Dataset& data,
                                const CameraFitOptions& options,
                                const std::function<bool(Index done, Index total)>& progress) {
  RadianceField frozen = field;
  TrainOptions run;
  run.schedule.steps = options.steps;
  run.samples_per_step = run.first_samples = options.samples_per_step;
  run.seed = options.seed;
  run.hard_pixels = 0;
  run.keep = run.freeze = run.refine_poses = run.image_colours = true;
  Trainer trainer(frozen, data, run);
  while (!trainer.done()) {
    trainer.step(0);
    if (trainer.steps() % kFitAsked == 0 && progress && !progress(trainer.steps(), options.steps)) break;
  }
  return trainer.cameras();
}

CameraMotion mean_motion(std::span<const Camera> from, std::span<const Camera> to) {
  check_sizes("mean_motion", from.size(), to.size());
  CameraMotion sum;
  for (std::size_t i = 0; i < from.size(); ++i) {
    sum.degrees += degrees_between(from[i].pose, to[i].pose);
    sum.distance += norm(from[i].position() - to[i].position());
  }
  const auto n = static_cast<double>(std::max<std::size_t>(from.size(), 1));
  return {.degrees = sum.degrees / n, .distance = sum.distance / n};
}

std::string format_transforms(std::span<const View> views, std::span<const Camera> cameras) {
  check_sizes("format_transforms", views.size(), cameras.size());
  nlohmann::ordered_json frames = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Camera& c = cameras[i];
    nlohmann::ordered_json matrix = nlohmann::ordered_json::array();
    for (std::size_t r = 0; r < 3; ++r)
      matrix.push_back({c.pose[4 * r], c.pose[4 * r + 1], c.pose[4 * r + 2], c.pose[4 * r + 3]});
    matrix.push_back({0., 0., 0., 1.});
    frames.push_back({{"file_path", views[i].name},
                      {"fl_x", c.fx},
                      {"fl_y", c.fy},
                      {"cx", c.cx},
                      {"cy", c.cy},
                      {"w", c.width},
                      {"h", c.height},
                      {"transform_matrix", matrix}});
  }
  return nlohmann::ordered_json{{"frames", frames}}.dump(1) + "\n";
}

}  // namespace fieldmark::nerf
