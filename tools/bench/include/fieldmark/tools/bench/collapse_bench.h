#pragma once
#include <fieldmark/nerf/trainer.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// Something that goes wrong in a training.
struct TrainingFault {
  std::string name;  ///< "network weights times 100"
  /// Damages the images or the options before the training; may be empty.
  std::function<void(nerf::Dataset& train, nerf::TrainOptions& options)> before{};
  /// Damages the field during the training; may be empty.
  std::function<void(nerf::RadianceField& field)> during{};
};

/// Returns faults that make a hash field's training collapse, each of another kind.
std::vector<TrainingFault> training_faults();

/// A training that must not be taken for collapsed.
struct OrdinaryTraining {
  std::string name;  ///< "preset mlp"
  nerf::RadianceFieldOptions field{};
  nerf::TrainOptions train{};
};

/// Returns the default and other settings that people choose. @param seed  of field and training
std::vector<OrdinaryTraining> ordinary_trainings(double seconds, std::uint64_t seed);

/// What nerf::CollapseWatch said of a training.
struct WatchedTraining {
  std::string scene;  ///< name of the data set
  std::string what;   ///< name of the fault, or of the setting
  Index steps = 0;    ///< taken in all
  /// Seconds from the fault, or from the start, to the word of the watch; negative before the fault, NaN if
  /// it said nothing.
  double noticed_after = std::numeric_limits<double>::quiet_NaN();
  std::string said;      ///< the word of the watch; empty: nothing
  double explained = 0;  ///< share of the validation images' variance that the field explains at the end
  /// True if a constant image fits better than the field at the end and the watch said nothing.
  bool missed() const { return said.empty() && !(explained > 0); }
};

/// Trains a hash field, damages it and trains on until the watch notices.
/// @param judge    images for the watch   @param healthy  seconds of training before TrainingFault::during
/// @param patience seconds after the fault at which the training ends unnoticed
WatchedTraining watch_fault(const nerf::Dataset& train, const nerf::Dataset& judge,
                            const TrainingFault& fault, double healthy, double patience, std::uint64_t seed);

/// Trains for the seconds of the schedule, or until the watch raises an alarm.
WatchedTraining watch_ordinary(const nerf::Dataset& train, const nerf::Dataset& judge,
                               const OrdinaryTraining& training);

}  // namespace fieldmark::bench
