#pragma once
#include <fieldmark/tools/bench/training_variants.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// A fault injected into a training.
struct TrainingFault {
  std::string name;  ///< "network weights times 100"
  /// Damages the images or the options before the training; may be empty.
  std::function<void(nerf::Dataset& train, nerf::TrainOptions& options)> before{};
  /// Damages the field during the training; may be empty.
  std::function<void(nerf::RadianceField& field)> during{};
};

/// Returns faults of several kinds, most of which make a hash field's training collapse.
std::vector<TrainingFault> training_faults();

/// Result of a training under nerf::CollapseWatch.
struct WatchedTraining {
  std::string scene;  ///< name of the data set
  std::string what;   ///< name of the fault, or of the setting
  Index steps = 0;    ///< taken in all
  /// Seconds from the fault, or from the start, to the alarm; negative before the fault, NaN without alarm.
  double noticed_after = std::numeric_limits<double>::quiet_NaN();
  std::string said;      ///< text of the alarm; empty: none
  double explained = 0;  ///< share of the validation images' variance that the field explains at the end
  /// True if a constant image fits better than the field at the end.
  bool collapsed() const { return !(explained > 0); }
};

/// When a fault strikes and how long it may go on.
struct FaultTimes {
  double after = 5;      ///< seconds of training before TrainingFault::during
  double patience = 15;  ///< seconds from the fault to the end of the training
  std::uint64_t seed = 0;
};

/// Trains a hash field, damages it and trains on until the watch notices or the time is over.
/// @param judge  images for the watch   @param tick  called before each step; may throw to stop
WatchedTraining watch_fault(const nerf::Dataset& train, const nerf::Dataset& judge,
                            const TrainingFault& fault, const FaultTimes& times,
                            const std::function<void()>& tick = {});

/// Trains to the end of the schedule, also after an alarm.
WatchedTraining watch_ordinary(const nerf::Dataset& train, const nerf::Dataset& judge,
                               const TrainingVariant& training, const std::function<void()>& tick = {});

}  // namespace fieldmark::bench
