#pragma once
#include <fieldmark/tools/bench/training_variants.h>

#include <functional>

namespace fieldmark::bench {

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
