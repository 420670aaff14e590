#pragma once
#include <fieldmark/engine/sharded_loop.h>
#include <fieldmark/engine/training_run.h>
#include <fieldmark/nerf/field_sampler.h>
#include <fieldmark/watermark/embedding/mark_psnr_meter.h>
#include <fieldmark/watermark/mark/owner.h>

namespace fieldmark::watermark {

class ReadingGuide;

/// Options for baking a message.
struct BakeOptions {
  /// Length of the run and step sizes for objects of preset hash; others take smaller ones (bake_plan.h).
  ScheduleOptions schedule{.seconds = 45, .lr = 5e-2, .half_after = 4000, .cooldown = 0.6, .last = 0.02};
  Index cameras = 400;      ///< novel cameras whose rays are used, >= 1
  Index around = 130;       ///< more in every direction for an object without surroundings (a cube), >= 0
  Index guide_views = 200;  ///< views that guide, >= 1; no more than are read are used
  /// Strength eta with which the extractor's reading shifts what rays show, times the mark's RMS, >= 0. Only
  /// objects of hash fields whose mark has cells are guided.
  double guidance = 2;
  std::uint64_t seed = 0;  ///< of cameras, rays and views
};

/// Distils the marked colours of one message into the colour side of a plain field:
///   minimise mean_r |sum_{i in r} w_i e_i - h_r|^2 + sum_i w_i |e_i|^2 / (10 sum_i w_i),
///   e_i = c(x_i, d_i) - c_t(x_i, d_i),   c_t = clamp(c_0 + f (c_m - c_0), 0, 1)
/// over samples i of rays r of novel cameras and, for an object, of cameras in every direction; c_0 are
/// unmarked colours, c_m marked ones, w_i the weights of the samples, and both terms are divided by the three
/// channels. The first term is what images show; the second keeps colours behind one another from
/// compensating each other. Two things are for objects of hash fields only:
/// - The emphasis f starts at 1. It rises while the learnt change has less power on rays than the mark, noise
///   included, and falls while it has more. It stays 1 for marks without a gain.
/// - If the mark has cells, the extractor reads one view of the field so far at every sixth step. Half of the
///   rays are pixels of views that it has read, and h_r leads what they show towards what it reads better,
///     h = -eta rho (1 - flatness) max(-3, min(3, g / rms(g))),   g = dL / dimage,
///   with the reading loss L of the view, distorted as in embedding (MarkTraining::reading_loss()), and the
///   RMS rho of the mark in it. For other rays h_r = 0.
/// Only the colour network and the colour features of the table move; everything that density depends on
/// keeps its bytes. The result has the tensor names, shapes and metadata of the unmarked field, and holds
/// neither network, extractor, key nor message.
class Baker final : public TrainingRun {
 public:
  /// The owner must outlive the baker. @throws ValueError if the length of the message is not the owner's, or
  /// an option is out of range
  Baker(const Owner& owner, const Message& message, const BakeOptions& options);
  ~Baker() override;
  /// Returns the running mean of the squared error between rays of the baked and the marked field, as a PSNR.
  double psnr() const;
  double figure() const override { return psnr(); }
  std::string status() const override;
  /// Mark PSNR of the baked field, dB, to compare with options().mark_psnr of the owner.
  struct MarkPsnr {
    double learnt = 0;  ///< after the last step; infinity where nothing differs
    double scaled = 0;  ///< after scale_to()
    double scale = 1;   ///< factor by which scale_to() multiplied the learnt change of the colour parameters
  };
  /// Moves the colour parameters along the line from the unmarked to the learnt ones until the mark PSNR is
  /// within 0.02 dB of the target on the given views (secant method). A learnt mark is 0.1 to 1.3 dB
  /// fainter than the owner's; more if the run was short or the field lacks capacity. Errors of the learnt
  /// colours are scaled, too. Call after the last step.
  /// @param target  dB   @return the result; the scale stays within 1/kLargestScale to kLargestScale
  MarkPsnr scale_to(double target, const MarkPsnrViews& views = {.seed = 32});
  /// Bound of the scale: 6 dB.
  static constexpr double kLargestScale = 2;
  /// Returns the emphasis f so far, kLeastEmphasis to kLargestEmphasis.
  double emphasis() const { return emphasis_; }
  /// Lower bound of the emphasis: -2 dB. Less would leave informed detection too little of the mark.
  static constexpr double kLeastEmphasis = 0.8;
  /// Upper bound of the emphasis: 6 dB.
  static constexpr double kLargestEmphasis = 2;
  /// Measures the mark PSNR of the baked field so far, see MarkPsnrMeter.
  double mark_psnr(const MarkPsnrViews& views = {.seed = 32}) const;
  /// Returns the baked field so far.
  const nerf::RadianceField& field() const { return field_; }

 private:
  struct Chunk;
  double take_step(double seconds) override;
  void describe(RunFingerprint& fingerprint) const override;
  struct Learnt {
    Var<float> features, rgb;
  };
  void choose_rays(Index chunk, Chunk& c) const;
  void take_pixels(const CachedView& view, Index chunk, Chunk& c) const;
  void sample(Index shard, Tape<float>& tape, Chunk& c);
  void set_target(Chunk& c) const;
  Learnt learnt_colours(Tape<float>& tape, Chunk& c, float* grads) const;
  double learn(Chunk& c, Tape<float>& tape, float* grads);
  static Index turns_until(Index step);
  void read_view(Index turn);
  std::span<float> network_grads();
  void update_emphasis();
  void backward_table();
  void set_scale(double scale, std::span<const float> learnt);

  const Owner& owner_;
  BakeOptions options_;
  Message message_;
  CounterRng rng_;
  nerf::RadianceField field_;
  std::vector<nerf::Camera> cameras_;
  nerf::Renderer::Recolour marking_;
  ShardedLoop<float> loop_;
  std::vector<Chunk> chunks_;  // of rays of a step
  std::vector<nerf::FieldSampler> samplers_;
  std::vector<nerf::RaySamples> samples_;
  std::unique_ptr<ReadingGuide> guide_;  // null: none
  std::vector<float> change_, asked_;    // [pixels, 3] of the view that the guide reads
  double emphasis_ = 1;
};

}  // namespace fieldmark::watermark
