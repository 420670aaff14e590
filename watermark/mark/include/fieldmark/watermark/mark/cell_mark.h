#pragma once
#include <fieldmark/extractor/dense_extractor.h>
#include <fieldmark/watermark/mark/mark.h>
#include <fieldmark/watermark/mark/mark_network.h>

namespace fieldmark::watermark {

/// Training options of a cell mark.
struct CellTrainingOptions {
  double first_mark_psnr = 28;  ///< dB at the first step; from there it approaches the owner's mark PSNR ...
  double anneal = 200;          ///< ... with this time constant, steps
  double sign_weight = 1;       ///< of the cross-entropy of the signs, per place
  double index_weight = 0.5;    ///< of the cross-entropy of the cells, per place
  double bits_weight = 0.5;     ///< of the cross-entropy of the pooled bits
  double smooth_weight = 0.4;   ///< of the share of the residual's power that remains after 8 x 8 pixel means
  double flat_weight = 0.4;     ///< of the share of the residual's power where the base image is flat
  double peak = 4;              ///< times the RMS: a colour that changes by more is a speck
  double peak_weight = 1;       ///< of the share of the residual's power that specks have beyond the peak
  double matrix_rate = 3;       ///< step size of Muon relative to Adam's; 0: Adam trains all weights
};

/// Returns the target RMS of the residual at a step, which falls from that of first_mark_psnr to that of
/// mark_psnr, dB.
double residual_rms(const CellTrainingOptions& options, double mark_psnr, Index step);

/// Options for making and training a cell mark.
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
///     + u (0.4 |mean of 8 x 8 pixels of r|^2 / |r|^2 + 0.4 |r on flat areas|^2 / |r|^2
///          + mean over foreground and colours of max(0, abs(r) - 4 rms(r))^2 / rms(r)^2)
/// where power_budget() fixes the power of the residual r instead of a content loss. u rises from 0 to 1
/// while the share of correct signs rises from 0.7 to 0.8: a mark must be readable before it can hide.
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
  /// The extractor that reads the mark.
  const extractor::DenseExtractor<float>& reader() const { return reader_; }
  /// The options given to the constructor.
  const CellMarkOptions& options() const { return options_; }

 private:
  CellMarkOptions options_;
  MarkNetwork<float> network_;
  extractor::DenseExtractor<float> reader_;
};

/// Returns the function that makes a CellMark.
MarkMaker cell_mark(const CellMarkOptions& options = {});
/// Parses options from a configuration of OWNER.   @throws nlohmann::json::exception if an option is missing
CellMarkOptions stored_cell_mark(const std::string& configuration);

}  // namespace fieldmark::watermark
