#pragma once
#include <fieldmark/extractor/pooled_extractor.h>
#include <fieldmark/imaging/vgg16_features.h>
#include <fieldmark/watermark/mark/global_mark.h>
#include <fieldmark/watermark/mark/mark.h>

namespace fieldmark::watermark {

/// Perceptual term of a content loss: lambda |Psi(marked) - Psi(base)|^2, beside |marked - base|^2.
struct PerceptualTerm {
  double weight = 0;  ///< lambda, at least 0; 0: no term
  /// Psi: the deepest features that the weights reach. Needed if weight > 0.
  std::shared_ptr<const Vgg16Features<float>> features{};
  std::string sha256{};  ///< of the weight file, for the fingerprint of a run; needed if weight > 0
};

/// Training options of a pooled mark.
struct PooledTrainingOptions {
  double content_weight = 1;    ///< gamma_1
  double content_psnr = 0;      ///< dB of a step's marked images, above which gamma_1 falls; 0: never
  double message_weight = 5;    ///< gamma_2
  PerceptualTerm perceptual{};  ///< of the content loss; none by default
  double matrix_rate = 0;       ///< step size of Muon relative to Adam's; 0: Adam trains all weights
  /// Steps of the warm start for up to 16 bits, >= 0; for more bits, in proportion.
  Index warm_steps = 0;
};

/// Makes slots that stand in for cells in a mark without cells: one per bit, of equal area and without a
/// place. The key deals order and signs of the bits to them as it does to cells.   @param bits  at least 1
CellGrid message_slots(Index bits);

class FixedCarriers;

/// Mark with one message for all places, which PooledExtractor reads from a whole image: the base of
/// FusionMark. Its evidence is the logit of every slot. Training minimises
///   L = gamma_1 (|marked - base|^2 + lambda |Psi(marked) - Psi(base)|^2) / n + gamma_2 BCE(bits, M)
/// where n is the number of values of an image, gamma_1 = content_weight min(1, m / m_0)^2 is a constant in
/// the gradient, m is the mean square of marked - base over the images of a step, and m_0 is that of
/// content_psnr. An optional warm start comes first: the extractor learns to read fixed carriers, pixel by
/// pixel, and the mark's networks learn to paint them.
/// Source: Luo et al. 2023 (CopyRNeRF), section 3.4, with a warm start and with a weight that falls for faint
/// marks.
class PooledMark : public Mark {
 public:
  /// Computes the marked image [pixels, 3] of a training image.   @param message  [1, N_b], -1 or 1
  using Painter = std::function<Var<float>(Tape<float>& tape, const Params<float>& params,
                                           const TrainingImage& image, Var<float> message)>;
  /// Computes the loss [1] of the mark's networks against carriers, on samples drawn for a step.
  using Learner = std::function<Var<float>(Tape<float>& tape, const Params<float>& params,
                                           const FixedCarriers& carriers, Index step)>;

  bool has_gain() const override { return false; }
  bool has_cells() const override { return false; }
  std::vector<double> evidence(const Owner& owner, const Tensor<float>& image,
                               SeenPlaces* places) const override;
  std::function<Var<float>(Var<float>)> confirmation(const Owner& owner,
                                                     const Tensor<float>& image) const override;
  std::unique_ptr<MarkTraining> training(const Owner& owner,
                                         std::span<const CachedView> views) const override;
  /// The extractor that reads the mark.
  const extractor::PooledExtractor<float>& reader() const { return reader_; }

 protected:
  /// @param reader  network that reads the message   @param training  options of training
  /// @param running_norm  true: images are read with the running statistics of training; false: with their
  /// own
  PooledMark(extractor::PooledExtractor<float> reader, const PooledTrainingOptions& training,
             bool running_norm)
      : reader_(std::move(reader)), training_(training), running_norm_(running_norm) {}
  /// Prepares the training images of the views, which must outlive the result, like the owner.
  virtual Painter painter(const Owner& owner, std::span<const CachedView> views) const = 0;
  /// Prepares the warm start of the mark's networks, with the lifetimes of painter(); empty: none.
  virtual Learner learner(const Owner&, std::span<const CachedView>) const { return {}; }

 private:
  extractor::PooledExtractor<float> reader_;
  PooledTrainingOptions training_;
  bool running_norm_;
};

/// Options for making and training a fusion mark.
struct FusionMarkOptions {
  Index width = 256;           ///< units of E and G, and N_c, see GlobalMarkOptions
  Index message_features = 0;  ///< N_m; 0: width
  Index channels = 64;         ///< of the extractor, see PooledExtractorOptions
  bool authors_code = false;   ///< see GlobalMarkOptions
  /// True: images are read with the running statistics of training; false: with their own.
  bool running_norm = false;
  /// Not stored in OWNER.
  PooledTrainingOptions training{};
};
/// Returns the options of preset paper: N_m = 256, the only size that the paper gives; 128 units and 32
/// channels elsewhere.
FusionMarkOptions paper_options();
/// Returns the options of preset code: the networks of the authors' code, with N_m = 128.
FusionMarkOptions code_options();

/// Mark of presets paper and code: GlobalMark replaces each colour by c_m.
class FusionMark : public PooledMark {
 public:
  /// @param network  makes the mark   @param reader  reads images
  FusionMark(GlobalMark<float> network, extractor::PooledExtractor<float> reader,
             const FusionMarkOptions& options)
      : PooledMark(std::move(reader), options.training, options.running_norm),
        network_(std::move(network)),
        options_(options) {}
  std::string preset() const override { return options_.authors_code ? "code" : "paper"; }
  std::string configuration() const override;
  nerf::Renderer::Recolour recolour(const Owner& owner, std::vector<std::int8_t> signs) const override;
  /// Returns colours as the network reads them: the colours themselves or, for the authors' code, the logit
  /// of each, clamped to those of 1e-3 and 1 - 1e-3, and log sigma / 16 at x.
  /// @param x  [n, 3]   @param rgb  [n, 3]   @return [n, 3] or [n, 4]
  std::vector<float> network_colours(const nerf::RadianceField& field, const float* x, const float* rgb,
                                     Index n) const;
  /// The network that fuses message and colours.
  const GlobalMark<float>& network() const { return network_; }

 protected:
  Painter painter(const Owner& owner, std::span<const CachedView> views) const override;
  Learner learner(const Owner& owner, std::span<const CachedView> views) const override;

 private:
  struct Lesson;
  Lesson lesson(Tape<float>& tape, const Owner& owner, std::span<const CachedView> views,
                std::span<const Index> shown, const FixedCarriers& carriers, Index step) const;

  GlobalMark<float> network_;
  FusionMarkOptions options_;
};

/// Returns the sizes of the mark's network for messages of `bits` bits.
GlobalMarkOptions network_options(const FusionMarkOptions& options, Index bits);
/// Makes the extractor of a pooled mark; its parameters follow those of the mark in the owner's store.
/// @throws ValueError unless the site has one slot for each bit
extractor::PooledExtractor<float> pooled_reader(const MarkSite& site, Index channels);
/// Returns the function that makes a FusionMark.
/// @throws ValueError as pooled_reader(), or if an option is out of range
MarkMaker fusion_mark(const FusionMarkOptions& options = {});
/// Parses options from a configuration of OWNER.   @throws ValueError for an ablation of version 0.1
FusionMarkOptions stored_fusion_mark(const std::string& configuration);

}  // namespace fieldmark::watermark
