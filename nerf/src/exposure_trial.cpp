#include <fieldmark/core/error.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/exposure_trial.h>

#include <cmath>

namespace fieldmark::nerf {
namespace {

constexpr Index kTrialAsked = 16;  // steps between two calls of progress
constexpr Index kTrialRays = 128;  // per step: unbounded scenes have hundreds of samples per ray at first

// Returns the root mean square over images of the relative change of mid grey.
double spread_of(std::span<const float> colours) {
  double sum = 0;
  for (std::size_t row = 0; row < colours.size(); row += 4) {
    const double change = static_cast<double>(colours[row] + colours[row + 1] + colours[row + 2]) +
                          static_cast<double>(colours[row + 3]) / 0.5;
    sum += change * change;
  }
  return std::sqrt(4 * sum / static_cast<double>(colours.size()));
}

}  // namespace

std::optional<ExposureTrial> try_exposures(const Dataset& train, const Dataset& held_out,
                                           const RadianceFieldOptions& field,
                                           const ExposureTrialOptions& options,
                                           const std::function<bool(Index done, Index total)>& progress) {
  if (options.steps < 64)
    throw ValueError("[exposure_trial] steps must be at least 64, got " + std::to_string(options.steps));
  Index before = 0;
  double spread = 0;
  const auto trained = [&](bool colours) -> std::optional<double> {
    RadianceField trial(field);
    TrainOptions run;
    run.schedule.steps = options.steps;
    run.samples_per_step = options.samples_per_step;
    run.least_rays = kTrialRays;
    run.seed = options.seed;
    run.image_colours = colours;
    Trainer trainer(trial, train, run);
    while (!trainer.done()) {
      trainer.step(0);
      if (trainer.steps() % kTrialAsked == 0 && progress &&
          !progress(before + trainer.steps(), 2 * options.steps))
        return {};
    }
    before += trainer.steps();
    if (colours) spread = spread_of(trainer.image_colours());
    Renderer renderer(trial);
    return evaluate(renderer, held_out).psnr_colour_fitted;
  };
  const auto without = trained(false);
  if (!without) return {};
  const auto with = trained(true);
  if (!with) return {};
  return ExposureTrial{.psnr_without = *without,
                       .psnr_with = *with,
                       .spread = spread,
                       .helps = *with >= *without + options.worth && spread >= options.least_spread};
}

}  // namespace fieldmark::nerf
