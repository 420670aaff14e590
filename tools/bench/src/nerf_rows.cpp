#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/trainer.h>

#include <chrono>

#include "rows.h"

namespace fieldmark::bench {
namespace {

// Measures samples per second once the field has taken shape. Steps differ, so a run is a stretch of steps.
EngineRow training_steps(const RowOptions& o, const std::string& which, Index first_samples, Index warm) {
  const auto scaled = [&](Index n) {
    return std::max<Index>(8, static_cast<Index>(static_cast<double>(n) * o.scale));
  };
  const nerf::Dataset built_in =
      o.scene ? nerf::Dataset{} : nerf::make_scene({.size = scaled(200), .views = scaled(50)});
  nerf::RadianceField field(nerf::RadianceFieldOptions{});
  warm = scaled(warm);
  const Index stretch = scaled(40);
  nerf::Trainer trainer(
      field, o.scene ? *o.scene : built_in,
      {.schedule = {.steps = warm + stretch * (o.runs + 1)}, .first_samples = first_samples});
  while (trainer.steps() < warm) trainer.step(0);
  const double before = trainer.samples();
  const Index steps = trainer.steps();
  const Timing t = time_calls(
      [&] {
        for (Index i = 0; i < stretch; ++i) trainer.step(0);
      },
      o.runs, 0);
  const double samples = (trainer.samples() - before) / static_cast<double>(trainer.steps() - steps);
  const auto each = static_cast<double>(stretch);
  EngineRow row =
      row_of({t.seconds / each, t.least / each, t.most / each, t.peak_operations / each}, 0, samples);
  row.what = which + " of the default field on " + (o.scene ? *o.scene : built_in).name;
  return row;
}

}  // namespace

std::vector<RowSpec> nerf_rows() {
  const nerf::TrainOptions defaults;
  return {{"nerf_step", "",
           [=](const RowOptions& o) {
             return training_steps(o, "training step", defaults.samples_per_step, 300);
           }},
          {"nerf_step_first", "", [=](const RowOptions& o) {
             return training_steps(o, "smaller first training step", defaults.first_samples, 600);
           }}};
}

}  // namespace fieldmark::bench
