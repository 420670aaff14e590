#pragma once
#include <fieldmark/engine/training_run.h>

#include <span>

#include "crop_source.h"
#include "image_marker.h"

namespace fieldmark::baselines {

/// Options for training a 2-D network.
struct HidingTrainOptions {
  ScheduleOptions schedule{.seconds = 180, .lr = 1e-3, .half_after = 1e6, .cooldown = 0.3, .last = 0.1};
  Index batch = 12;         ///< images per step, >= 2
  Index crop = 64;          ///< side of the images, pixels, a multiple of 16: the tile of an ImageMarker
  Index first_crop = 16;    ///< side during the first part of the run, where steps are fastest
  double first_part = 0.4;  ///< of the run, in [0, 1); then the side doubles at equal intervals, up to crop
  double first_mark_psnr = 14;     ///< at the first step, dB
  double mark_psnr = 30;           ///< at the end, dB, >= first_mark_psnr
  double message_weight = 1;       ///< weight of the message's mean squared error
  double adversary_weight = 1e-3;  ///< weight of the discriminator's loss
  double noisy_part = 1;           ///< fraction of the steps at mark_psnr that use a noise layer, in [0, 1]
  std::uint64_t seed = 0;          ///< seed of crops, messages and noise
};
/// Returns the authors' weights: HiDDeN 1 and 1e-3; MBRS 10 and 1e-4, with crops of a single size, that of
/// its map. HiDDeN, whose receptive field is small, uses crops of 16 for four fifths of the run and then 32,
/// a step size of 3e-3, and noise layers on half of the steps.
HidingTrainOptions hiding_train_options(HidingKind kind);

/// Returns by how much a mark becomes fainter after a step, dB: 0.015 while more than 93% of all bits are
/// right and each bit is right in more than 85% of the images, and more near 100%; else 0. Without the
/// condition on each bit, a bit that is learnt late would never have a strong mark.
/// @param read  fraction of the images in which each bit is right
double fading(std::span<const float> read);

/// Trains encoder and decoder jointly against a discriminator, with one random noise layer per batch:
///   L = w_m |M' - M|^2 + w_a BCE(discriminator(marked), "plain"),   marked = plain + g (encoded - plain)
/// Source: Zhu et al. 2018 (HiDDeN), section 3.3; Jia et al. 2021 (MBRS), section 3.4 for its weights.
/// Departure: the authors add w_i |marked - plain|^2 and train for epochs on a GPU. Here g, constant for the
/// gradients, scales the residual of each image to a PSNR that rises from first_mark_psnr to mark_psnr: by
/// fading() per step. Rounding to 8
/// bits, clamping and noise layers phase in over the last 3 dB, up to noisy_part of the steps. The networks
/// thus learn a message before it has to be invisible or robust. The result has equal bytes for any number of
/// threads.
class HidingTrainer final : public TrainingRun {
 public:
  /// Marker and crops must outlive the trainer. @throws ValueError if an option is out of range
  HidingTrainer(ImageMarker& marker, const CropSource& crops, const HidingTrainOptions& options);
  /// State of training.
  struct Figures {
    double bits = 0.5;      ///< running mean of the fraction of correct bits, after the noise layer
    double mark_psnr = 14;  ///< of the current step, dB
  };
  /// Returns the running mean of the fraction of images in which each bit is right.
  std::span<const float> read() const { return read_; }
  /// Returns the figures after the last step.
  const Figures& figures() const { return figures_; }
  double figure() const override { return figures_.bits; }
  std::string status() const override;

 private:
  double take_step(double seconds) override;
  void describe(RunFingerprint& fingerprint) const override;
  Index crop_now(double seconds) const;
  bool noisy() const;
  Var<float> sent_on(Var<float> marked, Var<float> plain) const;
  Var<float> at_strength(Var<float> encoded, Var<float> plain) const;
  void draw(Index size);
  double train_networks(Index size);
  void follow(const float* values);
  void train_discriminator(Index size);

  ImageMarker& marker_;
  const CropSource& crops_;
  HidingTrainOptions options_;
  CounterRng message_rng_, noise_rng_;
  ParamStore<float> critic_params_;
  Discriminator<float> critic_;
  Tape<float> tape_;
  std::vector<float> images_, messages_, marked_;
  std::vector<float> read_;
  Figures figures_;
  Index crop_ = 0;  // of the last step
};

}  // namespace fieldmark::baselines
