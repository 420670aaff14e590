#pragma once
#include <fieldmark/extractor/dense_extractor.h>
#include <fieldmark/watermark/mark/mark.h>
#include <fieldmark/watermark/mark/mark_network.h>

namespace fieldmark::watermark {

/// Weights of a cell mark's losses.
struct CellTrainingOptions {
  double first_mark_psnr = 28;  ///< dB at the first step, from where it approaches the owner's mark PSNR ...
  double anneal = 200;          ///< ... with this time constant, steps
  double sign_weight = 1;       ///< of the cross-entropy of the signs, place by place
  double index_weight = 0.5;    ///< of the cross-entropy of the cells, place by place
  double bits_weight = 0.5;     ///< of the cross-entropy of the pooled bits
  double smooth_weight = 0.4;   ///< of the share of the residual's power that is left after 8 x 8 pixel means
  double flat_weight = 0.4;     ///< of the share of the residual's power where the base image is flat
};

/// Root mean square of the residual at a step: falls from that of first_mark_psnr to that of mark_psnr, dB.
double residual_rms(const CellTrainingOptions& options, double mark_psnr, Index step);

/// How a cell mark is made and trained.
struct CellMarkOptions {
  MarkNetworkOptions network{};    ///< of the carrier
  Index base_channels = 32;        ///< of the extractor, see DenseExtractorOptions
  CellTrainingOptions training{};  ///< not stored in OWNER
};

/// Mark of preset fast: each cell of the scene carries one bit of the message.
///   c_m = clamp(c + g s(x) P(x, c), 0, 1)
/// with the carrier P of MarkNetwork, the signs s of CellGrid::blend() and the gain g. DenseExtractor reads
/// it. Training minimises
///   BCE(sign, s) on the foreground + 0.5 CE(index, cell) + 0.5 BCE(pooled bits, M)
///     + u (0.4 |mean of 8 x 8 pixels of r|^2 / |r|^2 + 0.4 |r on flat areas|^2 / |r|^2)
/// where power_budget() fixes the power of the residual r in place of a content loss. u rises from 0 to 1
/// while the share of right signs rises from 0.7 to 0.8: a mark must be readable before it can hide.
/// Source: Luo et al. 2023 (CopyRNeRF), sections 3.3 and 3.4, with local messages and dense supervision.
class CellMark : public Mark {
 public:
  /// @throws ValueError if an option is out of range
  CellMark(const MarkSite& site, const CellMarkOptions& options);
  std::string preset() const override { return "fast"; }
  std::string configuration() const override;
  nerf::Renderer::Recolour recolour(const Owner& owner, std::vector<std::int8_t> signs) const override;
  bool has_gain() const override { return true; }
  bool has_cells() const override { return true; }
  Var<float> carrier(const Params<float>& params, Var<float> x, Var<float> c) const override;
  std::vector<double> evidence(const Owner& owner, const Tensor<float>& image,
                               SeenPlaces* places) const override;
  std::function<Var<float>(Var<float>)> confirmation(const Owner& owner,
                                                     const Tensor<float>& image) const override;
  std::unique_ptr<MarkTraining> training(const Owner& owner,
                                         std::span<const CachedView> views) const override;
  /// Reads the mark.
  const extractor::DenseExtractor<float>& reader() const { return reader_; }
  /// The options given to the constructor.
  const CellMarkOptions& options() const { return options_; }

 private:
  CellMarkOptions options_;
  MarkNetwork<float> network_;
  extractor::DenseExtractor<float> reader_;
};

/// Makes a CellMark.
MarkMaker cell_mark(const CellMarkOptions& options = {});
/// Options from a configuration of OWNER.   @throws nlohmann::json::exception if it lacks one
CellMarkOptions stored_cell_mark(const std::string& configuration);

}  // namespace fieldmark::watermark
