#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/radiance_field.h>
#include <fieldmark/nerf/trainer.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// One setting for training a hash field; everything else is at its default.
struct TrainingVariant {
  std::string choice;                ///< the option that is varied: "batch", "learning rate", ...
  std::string setting;               ///< its value
  nerf::RadianceFieldOptions field;  ///< options of the field
  nerf::TrainOptions train;          ///< options of training, including the seed
};

/// Returns the default first, then every choice that this project's training makes, switched off or changed.
/// @param schedule  of all variants; its steps and seconds are kept
std::vector<TrainingVariant> training_variants(const ScheduleOptions& schedule, std::uint64_t seed);

/// Result of a variant.
struct TrainingRow {
  TrainingVariant variant;      ///< how it was trained
  Index steps = 0;              ///< taken
  double samples = 0;           ///< through the networks
  double seconds = 0;           ///< of its own training, including the silhouettes
  double psnr = 0;              ///< mean over the views of `judge`, against the ground truth, dB
  double seconds_per_view = 0;  ///< of rendering the views
};

/// Trains a field for each variant. The trainings alternate in turns of half a second, each with its own
/// clock, so that drift of the machine's speed affects them all alike. Needs the memory of all trainings
/// together.
/// @param train     training data   @param judge  views that the fields are evaluated on
/// @param progress  called before each turn with the variant's name and the fraction done; may throw to stop
/// @throws ValueError if an option is out of range
std::vector<TrainingRow> run_training_bench(
    const nerf::Dataset& train, const nerf::Dataset& judge, const std::vector<TrainingVariant>& variants,
    const std::function<void(const std::string&, double)>& progress = {});

}  // namespace fieldmark::bench
