#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>
#include <cmath>

#include "nerf/objects_scene.h"
#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "vec3.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {

TrainOptions train_options(Index steps) {
  return {.schedule = {.steps = steps},
          .samples_per_step = 8192,
          .first_samples = 4096,
          .grow_after = 16,
          .warm_up = 16};
}

float gain_of(std::size_t view) { return view % 2 == 0 ? 0.75f : 1; }

// Every other image is darker.
Dataset mixed_exposures() {
  Dataset data = objects_scene();
  for (std::size_t v = 0; v < data.views.size(); ++v)
    for (Index i = 0; i < data.views[v].rgba.size(); ++i)
      if (i % 4 != 3) data.views[v].rgba[i] *= gain_of(v);
  return data;
}

// Cameras rotated by about a degree and shifted by about a hundredth of their distance.
Dataset jittered() {
  Dataset data = objects_scene();
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    const double phase = static_cast<double>(v);
    Camera& c = data.views[v].camera;
    const Vec3 eye = c.position(),
               off{0.04 * std::sin(7 * phase), 0.04 * std::cos(5 * phase), 0.04 * std::sin(3 * phase + 1)};
    const Vec3 target = eye + 4. * c.forward() + 1.5 * Vec3{off[1], off[2], off[0]};
    c.pose = look_at(eye + off, target, {c.pose[1], c.pose[5], c.pose[9]});
  }
  return data;
}

// Returns the mean over views of the distance between the point that a camera looks at, at the scene's
// distance, and its true position, after subtracting the mean displacement.
double displacement(const std::vector<Camera>& cameras) {
  const Dataset& truth = objects_scene();
  std::vector<Vec3> off;
  Vec3 mean{};
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    const auto seen = [](const Camera& c) { return c.position() + 4. * c.forward(); };
    off.push_back(seen(cameras[v]) - seen(truth.views[v].camera));
    mean = mean + (1 / static_cast<double>(cameras.size())) * off.back();
  }
  double sum = 0;
  for (const Vec3& o : off) sum += norm(o - mean) / static_cast<double>(cameras.size());
  return sum;
}

// Everything that a run learned.
using Numbers = std::vector<std::vector<float>>;
Numbers numbers(const RadianceField& field, const Trainer& trainer) {
  Numbers all{{field.params.values().begin(), field.params.values().end()},
              {trainer.image_colours().begin(), trainer.image_colours().end()},
              {}};
  for (const Camera& c : trainer.cameras())
    for (const double p : c.pose) all.back().push_back(static_cast<float>(p));
  return all;
}

TrainOptions both(Index steps) {
  TrainOptions options = train_options(steps);
  options.image_colours = options.refine_poses = true;
  return options;
}

Numbers run_both(Index steps) {
  const Dataset data = mixed_exposures();
  RadianceField field(trainable_field_options());
  Trainer trainer(field, data, both(steps));
  while (!trainer.done()) trainer.step(0);
  return numbers(field, trainer);
}

}  // namespace

TEST_CASE("trainer images: gains of training images are found, and the field fits better for it") {
  const Dataset data = mixed_exposures();
  const auto trained = [&](bool colours) {
    RadianceField field(trainable_field_options());
    TrainOptions options = train_options(200);
    options.image_colours = colours;
    Trainer trainer(field, data, options);
    while (!trainer.done()) trainer.step(0);
    const auto found = trainer.image_colours();
    double dark = 0, bright = 0;
    for (std::size_t v = 0; 12 * v < found.size(); ++v)  // the result for grey
      for (std::size_t k = 0; k < 3; ++k) {
        const float* row = &found[12 * v + 4 * k];
        (v % 2 == 0 ? dark : bright) +=
            static_cast<double>(1 + row[0] + row[1] + row[2] + row[3] / 0.5f) / 18;
      }
    Renderer renderer(field);
    return std::tuple{evaluate(renderer, objects_scene()).psnr_colour_fitted, dark, bright};
  };
  const auto [without, none, nothing] = trained(false);
  const auto [with, dark, bright] = trained(true);
  CAPTURE(without, with, dark, bright);
  CHECK(none == 0);
  CHECK(nothing == 0);
  CHECK(dark / bright == Approx(0.75).margin(0.08));
  CHECK(dark + bright == Approx(2).margin(0.02));
  CHECK(with > without + 0.15);
}

TEST_CASE("trainer images: an mlp field learns gains too") {
  RadianceField field(small_mlp_options());
  TrainOptions options = nerf::train_options(FieldKind::mlp);
  options.schedule.steps = 5;
  options.samples_per_step = 4096;
  options.image_colours = true;
  const Dataset data = mixed_exposures();
  Trainer trainer(field, data, options);
  while (!trainer.done()) trainer.step(0);
  const auto found = trainer.image_colours();
  CHECK(found.size() == 12 * 12);
  CHECK(std::ranges::any_of(found, [](float d) { return d != 0; }));
  CHECK(std::ranges::all_of(found, [](float d) { return std::isfinite(d); }));
}

TEST_CASE("trainer images: jittered cameras come back") {
  const Dataset data = jittered();
  RadianceField field(trainable_field_options());
  TrainOptions options = train_options(300);
  options.refine_poses = true;
  Trainer trainer(field, data, options);
  const double before = displacement(trainer.cameras());
  while (!trainer.done()) trainer.step(0);
  const double after = displacement(trainer.cameras());
  CAPTURE(before, after);
  CHECK(before > 0.05);
  CHECK(after < 0.5 * before);
}

TEST_CASE("trainer images: a frozen field keeps its bytes while cameras move") {
  RadianceField field(trainable_field_options());
  {
    Trainer trainer(field, objects_scene(), train_options(40));
    while (!trainer.done()) trainer.step(0);
  }
  const std::vector<float> values(field.params.values().begin(), field.params.values().end());
  const std::vector<std::uint8_t> bits(field.grid.bits().begin(), field.grid.bits().end());
  const Dataset data = jittered();
  TrainOptions options = train_options(5);
  options.keep = options.freeze = options.refine_poses = true;
  Trainer trainer(field, data, options);
  while (!trainer.done()) trainer.step(0);
  CHECK(trainer.cameras()[0].pose != data.views[0].camera.pose);
  CHECK(std::ranges::equal(field.params.values(), values));
  CHECK(std::ranges::equal(field.grid.bits(), bits));
}

TEST_CASE("trainer images: the same bytes for one and two threads, and across a restore") {
  const TemporaryFolder folder;
  Numbers one, two;
  {
    const ScopedThreads scope(1);
    one = run_both(12);
  }
  const ScopedThreads scope(2);
  two = run_both(12);
  CHECK(one == two);
  const Dataset data = mixed_exposures();
  {
    RadianceField field(trainable_field_options());
    Trainer trainer(field, data, both(12));
    while (trainer.steps() < 5) trainer.step(0);
    trainer.save(folder / "checkpoint");
  }
  RadianceField field(trainable_field_options());
  Trainer trainer(field, data, both(12));
  trainer.restore(folder / "checkpoint");
  while (!trainer.done()) trainer.step(0);
  CHECK(numbers(field, trainer) == one);
  TrainOptions off = both(12);
  off.image_colours = false;
  Trainer different(field, data, off);
  CHECK_THROWS_WITH(different.restore(folder / "checkpoint"),
                    Contains("option 'image_colours' true, this run has none"));
}

TEST_CASE("trainer images: errors name what is needed") {
  RadianceField mlp(small_mlp_options()), hash(trainable_field_options());
  CHECK_THROWS_WITH(Trainer(mlp, objects_scene(), {.refine_poses = true}),
                    "[trainer] field must be a hash field to refine poses or to be frozen, got an mlp field");
  CHECK_THROWS_WITH(Trainer(hash, objects_scene(), {.refine_poses = true, .freeze = true}),
                    "[trainer] freeze needs keep, and image_colours or refine_poses to learn");
  CHECK_THROWS_WITH(Trainer(hash, objects_scene(), {.keep = true, .freeze = true}), Contains("to learn"));
}
