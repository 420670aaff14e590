#pragma once
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/watermark/mark/fusion_mark.h>

#include "fixed_carriers.h"

namespace fieldmark::watermark {

/// Training of a PooledMark: first on FixedCarriers, then on the paper's loss. One pass takes all images of a
/// step, because an extractor with running statistics normalises by those of the batch.
class PooledTraining : public MarkTraining {
 public:
  /// @param running_norm  see FusionMarkOptions   @param painter  makes the marked images
  /// @param learner  loss of the mark's networks against carriers; may be empty
  PooledTraining(const extractor::PooledExtractor<float>& reader, const PooledTrainingOptions& options,
                 bool running_norm, const Owner& owner, std::span<const CachedView> views,
                 PooledMark::Painter painter, PooledMark::Learner learner);

  bool whole_batch() const override { return true; }
  Var<float> loss(Tape<float>& tape, const Params<float>& params, std::span<const TrainingImage> images,
                  const TrainingFigures& running, TrainingFigures& figures) override;
  Index warm_steps() const override;
  MuonWeights matrices() const override { return {{"extractor/*/conv/weight"}, options_.matrix_rate}; }
  ParamStore<float>* helpers() override { return carriers_ ? &helpers_ : nullptr; }
  void finish_step(ParamStore<float>& params) override;
  std::string note(const TrainingFigures& f) const override;
  void describe(RunFingerprint& f) const override;

 private:
  using Places = extractor::PooledExtractor<float>::Places;
  double content_weight(double mean_square) const;
  void keep_features();
  Var<float> features_of(Var<float> image) const;
  Var<float> content_loss(std::span<const TrainingImage> images, std::span<const Var<float>> marked) const;
  Var<float> perceptual_loss(Var<float> marked, const Tensor<float>& features) const;
  Var<float> read(const Params<float>& params, std::span<const Var<float>> seen);
  Places read_places(const Params<float>& params, std::span<const Var<float>> seen);
  Var<float> lesson(Tape<float>& tape, const Params<float>& params, std::span<const TrainingImage> images,
                    TrainingFigures& figures);
  Var<float> reading_lesson(Tape<float>& tape, const Params<float>& params,
                            std::span<const TrainingImage> images, TrainingFigures& figures);
  Tensor<std::int32_t> carried_bits(const TrainingImage& image, const Shape& seen) const;
  Var<float> message_loss(Var<float> logits, std::span<const TrainingImage> images, TrainingFigures& figures);

  const extractor::PooledExtractor<float>& reader_;
  PooledTrainingOptions options_;
  bool running_norm_;
  const Owner& owner_;
  std::span<const CachedView> views_;
  PooledMark::Painter painter_;
  PooledMark::Learner learner_;
  std::vector<Tensor<float>> features_;    // Psi of each view's unmarked image, with a perceptual term
  std::optional<FixedCarriers> carriers_;  // of a warm start
  ParamStore<float> helpers_;
  std::vector<Dense<float>> recognise_;  // one layer in a warm start: finds the bit that a pixel carries
  std::vector<BatchStatistics> statistics_;
};

}  // namespace fieldmark::watermark
