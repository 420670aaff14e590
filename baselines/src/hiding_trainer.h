#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/nerf/schedule.h>
#include "crop_source.h"
#include "image_marker.h"

namespace fieldmark::baselines {

/// How a 2-D network is trained.
struct HidingTrainOptions {
  /// Length of the run and step sizes; Adam as the networks' authors have it, with 1e-3.
  nerf::ScheduleOptions schedule{.seconds = 180, .lr = 1e-3, .half_after = 1e6, .cooldown = 0.3, .last = 0.1};
  Index batch = 12;         ///< images a step, at least 2
  Index crop = 64;          ///< pixels of their sides, a multiple of 16; the size of a ImageMarker's tiles
  Index first_crop = 16;    ///< of the first part of the run: the message is found at a sixteenth of the work
  double first_part = 0.4;  ///< of the run, in [0, 1); then the sides double, after equal parts, up to crop
  double first_mark_psnr = 14;     ///< of the mark at first, dB
  double mark_psnr = 30;           ///< to which it is brought, dB, not below first_mark_psnr
  double message_weight = 1;       ///< of the message's mean squared error
  double adversary_weight = 1e-3;  ///< of the discriminator's verdict
  double noisy_part = 1;           ///< of the steps at the last strength that pass a noise layer, in [0, 1]
  std::uint64_t seed = 0;          ///< of crops, messages and noise
};
/// The weights of a network's authors: HiDDeN 1 and 1e-3; MBRS 10 and 1e-4, and one size of crops, that of
/// its map. HiDDeN, whose networks look at some pixels around each, takes crops of 16 for four fifths of the
/// run, then 32; a step size of 3e-3; and noise layers on half of the steps.
HidingTrainOptions hiding_train_options(HidingKind kind);

/// Trains encoder and decoder together, against a discriminator, through a random noise layer a batch:
///   L = w_m |M' - M|^2 + w_a BCE(discriminator(marked), "plain"),   marked = plain + g (encoded - plain)
/// Source: Zhu et al. 2018 (HiDDeN), section 3.3; Jia et al. 2021 (MBRS), section 3.4 for its weights.
/// Departure: the authors have w_i |marked - plain|^2 in the loss, and epochs of it on a GPU. Here g, which
/// gradients take for a constant, brings the residual of each image to a strength in dB that goes from
/// first_mark_psnr to strength by 0.015 a step as long as 93 bits in a hundred are read, and faster where
/// hardly one is wrong; files (8 bits, no values beyond black and white) and noise layers come in over the
/// last 3 dB, up to noisy_part of the steps. There is a message before it has to be invisible or robust, and
/// ImageMarker::mark() brings it to a strength in the same way. Same seed and number of steps: same bytes,
/// for any thread count and across save() and restore().
class HidingTrainer {
 public:
  /// Marker and crops must outlive the trainer. @throws ValueError if an option is out of range
  HidingTrainer(ImageMarker& marker, const CropSource& crops, const HidingTrainOptions& options);
  /// Takes one step. @param seconds  since the start of the run, for a schedule that ends at a time
  void step(double seconds);
  /// Whether the run has all its steps.
  bool done() const { return schedule_.done(steps_); }
  /// Steps taken, those before a restore() included.
  Index steps() const { return steps_; }
  /// Of training as it goes.
  struct Figures {
    double bits = 0.5;      ///< running mean of the share of bits read right, behind the noise layer
    double mark_psnr = 14;  ///< at which images are marked now, dB
  };
  /// As of the last step.
  const Figures& figures() const { return figures_; }
  /// @throws IoError
  void save(const std::filesystem::path& path) const;
  /// @throws IoError if the file is not a checkpoint of the same configuration
  void restore(const std::filesystem::path& path);

 private:
  Index crop_now(double seconds) const;
  bool noisy() const;
  Var<float> sent_on(Var<float> marked, Var<float> plain) const;
  Var<float> at_strength(Var<float> encoded, Var<float> plain) const;
  void draw(Index size);
  void train_networks(Index size);
  void train_discriminator(Index size);
  std::string fingerprint() const;

  ImageMarker& marker_;
  const CropSource& crops_;
  HidingTrainOptions options_;
  nerf::Schedule schedule_;
  CounterRng message_rng_, noise_rng_;
  ParamStore<float> critic_params_;
  Discriminator<float> critic_;
  Adam<float> adam_, critic_adam_;
  Tape<float> tape_;
  std::vector<float> images_, messages_, marked_;
  Figures figures_;
  Index steps_ = 0;
  Index crop_ = 0;  // of the last step
};

}  // namespace fieldmark::baselines
