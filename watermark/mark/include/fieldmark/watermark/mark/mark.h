#pragma once
#include <fieldmark/engine/run_fingerprint.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/mark/cell_code.h>
#include <fieldmark/watermark/mark/cell_grid.h>
#include <fieldmark/watermark/mark/object_window.h>
#include <fieldmark/watermark/mark/view_cache.h>

#include <array>
#include <functional>
#include <memory>
#include <string>

namespace fieldmark::watermark {

class Owner;

/// The cell that each place of an image shows.
struct SeenPlaces {
  Window window{};                   ///< part of the image that is divided into places
  Index height = 0;                  ///< in places; 0 for a mark without cells
  Index width = 0;                   ///< in places
  std::vector<std::int32_t> cell{};  ///< [height, width] likeliest cell, -1 for the background
  std::vector<float> share{};        ///< [height, width] probability of that cell, in [0, 1]
};

/// Means over training images, which are distorted as in training.
struct TrainingFigures {
  double sign = 0;   ///< share of the foreground's places with the correct sign; 0 for a mark without cells
  double index = 0;  ///< share of the foreground's places with the correct cell; 0 for a mark without cells
  double bits = 0;   ///< share of correct bits
  double loss = 0;   ///< of one image
};

/// Everything drawn at random for one training image.
struct TrainingImage {
  Index view = 0;                    ///< index into the cached views
  Index step = 0;                    ///< of the run
  CellCode code{};                   ///< of a key drawn for this image, so that training learns no key
  Message message{};                 ///< embedded
  std::vector<std::int8_t> signs{};  ///< of the cells, see cell_signs()
  const float* positions = nullptr;  ///< [S, 3] samples of the view, shifted at random
  bool warped = false;               ///< true if `distort` applies `warp`
  std::array<float, 6> warp{};       ///< see distort::affine_warp()
  /// Distorts a marked image [H, W, 3]; a warped image has the extractor's size.
  std::function<Var<float>(Var<float> image)> distort{};
};

/// Weights of the extractor that Muon trains in place of Adam.
struct MuonWeights {
  std::vector<std::string> names{};  ///< patterns, see Muon
  double rate = 0;                   ///< step size relative to Adam's; 0: Adam trains them
};

/// Training of one kind of mark on the cached views of one owner.
class MarkTraining {
 public:
  virtual ~MarkTraining() = default;
  /// True if loss() takes all images of a step at once, because one image's loss depends on the others.
  virtual bool whole_batch() const { return false; }
  /// Computes the loss [1], mean over images: marks, distorts and reads each image. Several threads call it
  /// at the same time with one image each, unless whole_batch().
  /// @param params  of the owner   @param running  means over the run so far
  /// @param figures  written: means over these images, without the loss
  virtual Var<float> loss(Tape<float>& tape, const Params<float>& params,
                          std::span<const TrainingImage> images, const TrainingFigures& running,
                          TrainingFigures& figures) = 0;
  /// Computes the part of loss() that concerns the reading of one image [1]: distorts and reads it. Several
  /// threads may call it at the same time.
  /// @param marked  [pixels, 3] of the image's view   @param figures  written as by loss()
  /// @throws ValueError without cells
  virtual Var<float> reading_loss(const Params<float>& params, Var<float> marked, const TrainingImage& image,
                                  TrainingFigures& figures) const;
  /// Number of warm-up steps, which prepare the networks before training on the mark's own loss.
  virtual Index warm_steps() const { return 0; }
  /// Returns the weights that Muon trains; default: none.
  virtual MuonWeights matrices() const { return {}; }
  /// Returns the parameters of networks that only training needs and the owner does not keep; null: none.
  virtual ParamStore<float>* helpers() { return nullptr; }
  /// Updates state without gradients, such as running statistics of the owner, after each step.
  virtual void finish_step(ParamStore<float>&) {}
  /// Formats running means for a progress line.
  virtual std::string note(const TrainingFigures& running) const = 0;
  /// Adds all training options of this kind to the fingerprint, so that a checkpoint with other options is
  /// refused.
  virtual void describe(RunFingerprint& fingerprint) const = 0;
};

/// A kind of mark: how a message changes colours, how an image is read, and how both are trained and stored.
/// A mark holds networks and options but no parameters; these belong to its owner, which is passed to each
/// call.
class Mark {
 public:
  virtual ~Mark() = default;
  /// Returns the preset that makes this kind of mark, as stored in OWNER.
  virtual std::string preset() const = 0;
  /// Returns the kind's part of the configuration of OWNER: a JSON object, read by stored_mark().
  virtual std::string configuration() const = 0;

  /// Deals the cells to the bits of a message under a key, see deal_cells().
  virtual CellCode code(const CellGrid& cells, const Key& key, Index bits) const;
  /// Makes the function that computes the colours of the marked field, see nerf::Renderer::set_recolour().
  /// @param owner  must outlive the function   @param signs  of the cells, see cell_signs()
  virtual nerf::Renderer::Recolour recolour(const Owner& owner, std::vector<std::int8_t> signs) const = 0;
  /// True if Owner::gain scales the mark; otherwise its networks alone determine the mark PSNR.
  virtual bool has_gain() const = 0;
  /// True if the message lies in cells of the scene: then evidence() finds places, and informed detection
  /// works.
  virtual bool has_cells() const = 0;
  /// Computes the change of colour at sign +1 and gain 1.
  /// @param x  [N, 3] unit cube   @param c  [N, 3] base colours
  /// @return [N, 3]   @throws ValueError without cells
  virtual Var<float> carrier(const Params<float>& params, Var<float> x, Var<float> c) const;

  /// Computes the blind detector reading S_c of every cell.
  /// @param image  [H, W, 3] of the extractor's size   @param places  written, except the window, unless null
  virtual std::vector<double> evidence(const Owner& owner, const Tensor<float>& image,
                                       SeenPlaces* places) const = 0;
  /// Makes a loss [1] of an image [H W, 3] that is least where the extractor confirms its reading of `image`.
  /// @param image  [H, W, 3], the other image   @param owner  must outlive the function
  virtual std::function<Var<float>(Var<float> image)> confirmation(const Owner& owner,
                                                                   const Tensor<float>& image) const = 0;
  /// Prepares training. The owner and the views must outlive the result.
  virtual std::unique_ptr<MarkTraining> training(const Owner& owner,
                                                 std::span<const CachedView> views) const = 0;
};

/// Parts of an owner under construction that its mark depends on.
struct MarkSite {
  ParamStore<float>& params;         ///< store to which the mark adds "mark/..." and "extractor/..."
  const nerf::RadianceField& field;  ///< unmarked
  const CellGrid& cells;             ///< of the scene, or message_slots()
  Index bits = 0;                    ///< of a message
  std::uint64_t seed = 0;            ///< of the initial parameters
};

/// Makes a mark for an owner.
using MarkMaker = std::function<std::shared_ptr<const Mark>(const MarkSite& site)>;

/// Returns the function that makes the kind of mark that a configuration of OWNER describes.
/// @throws ValueError if it describes none, or an ablation   @throws nlohmann::json::exception if it is not
/// JSON
MarkMaker stored_mark(const std::string& configuration);

}  // namespace fieldmark::watermark
