#pragma once
#include <fieldmark/nerf/trainer.h>

#include <string>
#include <vector>

namespace fieldmark::bench {

/// One setting for training a field; everything else is at its default.
struct TrainingVariant {
  std::string choice;                ///< the option that is varied: "batch", "learning rate", ...
  std::string setting;               ///< its value
  nerf::RadianceFieldOptions field;  ///< options of the field
  nerf::TrainOptions train;          ///< options of training, including the seed

  /// Returns "choice: setting".
  std::string name() const { return choice + ": " + setting; }
};

/// Returns the default first, then every choice that this project's training of a hash field makes, switched
/// off or changed.
/// @param schedule  of all variants; its steps and seconds are kept   @param seed  of field and training
std::vector<TrainingVariant> training_variants(const ScheduleOptions& schedule, std::uint64_t seed);

/// Returns settings that must not end in a collapse: the default first, preset mlp, exposures, refined poses,
/// a small table, then the other training_variants().
std::vector<TrainingVariant> ordinary_trainings(const ScheduleOptions& schedule, std::uint64_t seed);

}  // namespace fieldmark::bench
