#pragma once
#include <fieldmark/nerf/trainer.h>

#include <functional>
#include <optional>

namespace fieldmark::nerf {

/// Budget and criterion of try_exposures().
struct ExposureTrialOptions {
  Index steps = 512;              ///< of each short training, >= 64
  Index samples_per_step = 8192;  ///< of each short training, see TrainOptions
  double worth = 0.1;             ///< dB that exposures must gain on held-out images
  double least_spread = 0.1;      ///< of exposures that are worth learning, see ExposureTrial::spread
  std::uint64_t seed = 0;         ///< of fields and trainings
};

/// The result of try_exposures().
struct ExposureTrial {
  double psnr_without = 0;  ///< dB, see Evaluation::psnr_colour_fitted
  double psnr_with = 0;     ///< the same for a field trained with TrainOptions::image_colours
  double spread = 0;        ///< root mean square over images of the relative change of mid grey
  bool helps = false;       ///< true if exposures gain `worth` and differ enough: after few steps, a field
                            ///< gains from colours per image even if all are exposed alike
};

/// Tests whether a hash field learns a scene better with an exposure per training image: compares two short
/// trainings on held-out images, both after colour_fitted().
/// @param progress  called during each training; returns false to stop. May be empty   @return none if
/// stopped
/// @throws ValueError if an option is out of range or there are no held-out views
std::optional<ExposureTrial> try_exposures(const Dataset& train, const Dataset& held_out,
                                           const RadianceFieldOptions& field,
                                           const ExposureTrialOptions& options,
                                           const std::function<bool(Index done, Index total)>& progress = {});

}  // namespace fieldmark::nerf
