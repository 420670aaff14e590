#pragma once
#include <fieldmark/engine/sharded_loop.h>
#include <fieldmark/engine/training_run.h>
#include <fieldmark/nerf/field_sampler.h>
#include <fieldmark/watermark/embedding/mark_psnr_meter.h>
#include <fieldmark/watermark/mark/owner.h>

namespace fieldmark::watermark {

/// How a message is baked.
struct BakeOptions {
  /// Length of the run and step sizes.
  ScheduleOptions schedule{.seconds = 45, .lr = 1e-2, .half_after = 4000, .cooldown = 0.6, .last = 0.02};
  Index cameras = 400;     ///< novel cameras whose rays are used, >= 1
  Index around = 130;      ///< more in every direction, of an object that has no surroundings (a cube), >= 0
  std::uint64_t seed = 0;  ///< of cameras and rays
};

/// Distils the marked colours of one message into the colour side of a plain field:
///   minimise mean_r |sum_{i in r} w_i e_i|^2 + sum_i w_i |e_i|^2 / (10 sum_i w_i),
///   e_i = c(x_i, d_i) - c_m(x_i, d_i)
/// over samples i of rays r of novel cameras and, of an object, of cameras in every direction, w_i their
/// weights, both divided by the three channels. The first is what images show, the second keeps colours
/// behind one another from making up for each other. Only the colour network and the colour features of the
/// table move; whatever density depends on keeps its bytes. The result has the tensor names, shapes and
/// metadata of the unmarked field, and holds neither network, extractor, key nor message.
class Baker final : public TrainingRun {
 public:
  /// The owner must outlive it. @throws ValueError if the message has another length than the owner's, or an
  /// option is out of range
  Baker(const Owner& owner, const Message& message, const BakeOptions& options);
  ~Baker() override;
  /// Running mean of the distance between what rays of the baked and of the marked field show, as a PSNR.
  double psnr() const;
  double figure() const override { return psnr(); }
  std::string status() const override;
  /// How strong the mark is in the baked field, dB as options().strength of the owner counts.
  struct MarkPsnr {
    double learnt = 0;  ///< as the steps left it, infinity where nothing differs
    double scaled = 0;  ///< after scale_to()
    double scale = 1;   ///< what scale_to() multiplied the learnt change of the colour numbers by
  };
  /// Moves the colour numbers along the line from the unmarked to the learnt ones to where the mark has the
  /// strength asked for, by secants until it is within 0.02 dB on the views it looks at. Colours
  /// learn a mark some 1.3 dB fainter than the owner's; more if the run was short or the field has no room
  /// for it. What they learnt wrong is scaled, too. For after the last step.
  /// @param target  dB   @return what came of it; the scale stays within 1/kLargestScale to kLargestScale
  MarkPsnr scale_to(double target, const MarkPsnrViews& views = {.seed = 32});
  /// Bound of the scale: 6 dB.
  static constexpr double kLargestScale = 2;
  /// The strength as far as it is, see MarkPsnrMeter.
  double mark_psnr(const MarkPsnrViews& views = {.seed = 32}) const;
  /// The baked field as far as it is.
  const nerf::RadianceField& field() const { return field_; }

 private:
  struct Chunk;
  double take_step(double seconds) override;
  void describe(RunFingerprint& fingerprint) const override;
  void choose_rays(Index chunk, Chunk& c) const;
  void select(const nerf::RaySamples& samples, Chunk& c) const;
  double run_chunk(Index index, Index shard, Tape<float>& tape, float* grads);
  void backward_table();
  void seek(double target, std::span<const float> learnt, const std::function<double()>& measure,
            MarkPsnr& found);
  void set_scale(double scale, std::span<const float> learnt);

  const Owner& owner_;
  BakeOptions options_;
  Message message_;
  CounterRng rng_;
  nerf::RadianceField field_;
  std::vector<nerf::Camera> cameras_;
  nerf::Renderer::Recolour marking_;
  ShardedLoop<float> loop_;
  std::vector<Chunk> chunks_;
  std::vector<nerf::FieldSampler> samplers_;
  std::vector<nerf::RaySamples> samples_;
};

}  // namespace fieldmark::watermark
