#pragma once
#include <fieldmark/nerf/trainer.h>

#include <vector>

#include "nerf/objects_scene.h"
#include "nerf/small_field.h"

/// Options of a short run. Cells may be declared empty and steps grow after 16 steps, so that short runs pass
/// through everything that a long one does.
inline fieldmark::nerf::TrainOptions short_run_options(fieldmark::Index steps) {
  return {.schedule = {.steps = steps},
          .samples_per_step = 8192,
          .first_samples = 2048,
          .grow_after = 16,
          .distortion = 1e-3,
          .warm_up = 16};
}

/// Options of a short run of a small mlp field.
inline fieldmark::nerf::TrainOptions short_mlp_run_options(fieldmark::Index steps) {
  fieldmark::nerf::TrainOptions options = train_options(fieldmark::nerf::FieldKind::mlp);
  options.schedule.steps = steps;
  options.schedule.lr = 5e-3;  // the networks are small
  options.samples_per_step = 4096;
  return options;
}

/// Everything that training leaves behind.
struct TrainerOutcome {
  std::vector<float> values;
  std::vector<std::uint8_t> bits;
  double psnr = 0, samples = 0;
  friend bool operator==(const TrainerOutcome&, const TrainerOutcome&) = default;
};
inline TrainerOutcome outcome_of(const fieldmark::nerf::RadianceField& f, const fieldmark::nerf::Trainer& t) {
  return {{f.params.values().begin(), f.params.values().end()},
          {f.grid.bits().begin(), f.grid.bits().end()},
          t.train_psnr(),
          t.samples()};
}

/// Trains a field for so many steps.
inline TrainerOutcome outcome_of_run(fieldmark::Index steps) {
  fieldmark::nerf::RadianceField field(trainable_field_options());
  fieldmark::nerf::Trainer trainer(field, objects_scene(), short_run_options(steps));
  while (!trainer.done()) trainer.step(0);
  return outcome_of(field, trainer);
}
