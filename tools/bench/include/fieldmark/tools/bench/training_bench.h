#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/radiance_field.h>
#include <fieldmark/nerf/trainer.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// One choice of how a hash field is trained, all else being as by default.
struct TrainingVariant {
  std::string choice;                ///< what is chosen: "batch", "learning rate", ...
  std::string setting;               ///< how
  nerf::RadianceFieldOptions field;  ///< what is trained
  nerf::TrainOptions train;          ///< how, the seed included
};

/// The default first, then every choice that trainings of this project make, switched off or set otherwise.
/// @param schedule  of all of them; its steps and seconds are kept
std::vector<TrainingVariant> training_variants(const ScheduleOptions& schedule, std::uint64_t seed);

/// What a variant reached.
struct TrainingRow {
  TrainingVariant variant;      ///< how it was trained
  Index steps = 0;              ///< taken
  double samples = 0;           ///< through the networks
  double seconds = 0;           ///< of its own training, the silhouettes included
  double psnr = 0;              ///< mean over the views of `judge`, against the ground truth, dB
  double seconds_per_view = 0;  ///< of rendering them
};

/// Trains a field for each variant, all at once and by turns of half a second, each with a clock of its own:
/// a machine's drift meets them all alike. Takes the memory of all trainings together.
/// @param train     what is learnt   @param judge  what the fields are judged by
/// @param progress  called before each turn with the variant's name and the part that is done of all; may
/// throw to stop
/// @throws ValueError if an option is out of range
std::vector<TrainingRow> run_training_bench(
    const nerf::Dataset& train, const nerf::Dataset& judge, const std::vector<TrainingVariant>& variants,
    const std::function<void(const std::string&, double)>& progress = {});

}  // namespace fieldmark::bench
