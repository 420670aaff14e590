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

/// Where an image shows which cell.
struct SeenPlaces {
  Window window{};                   ///< part of the image that the places divide
  Index height = 0;                  ///< in places; 0 for a mark without cells
  Index width = 0;                   ///< in places
  std::vector<std::int32_t> cell{};  ///< [height, width] likeliest cell, -1 for the background
  std::vector<float> share{};        ///< [height, width] its probability, in [0, 1]
};

/// Means over training images, distorted as in training.
struct TrainingFigures {
  double sign = 0;   ///< share of the foreground's places whose sign is right; 0 for a mark without cells
  double index = 0;  ///< share of the foreground's places whose cell is right; 0 for a mark without cells
  double bits = 0;   ///< share of bits that are right
  double loss = 0;   ///< of one image
};

/// Everything drawn at random for one training image.
struct TrainingImage {
  Index view = 0;                    ///< of the cached views
  Index step = 0;                    ///< of the run
  CellCode code{};                   ///< of a key drawn for this image, so that training learns none
  Message message{};                 ///< embedded
  std::vector<std::int8_t> signs{};  ///< of the cells, see cell_signs()
  const float* positions = nullptr;  ///< [S, 3] samples of the view, shifted at random
  bool warped = false;               ///< whether `distort` applies `warp`
  std::array<float, 6> warp{};       ///< see distort::affine_warp()
  /// Distorts a marked image [H, W, 3]; a warped image has the extractor's size.
  std::function<Var<float>(Var<float> image)> distort{};
};

/// Training of one kind of mark on the cached views of one owner.
class MarkTraining {
 public:
  virtual ~MarkTraining() = default;
  /// Whether loss() takes all images of a step at once, because what one image gives depends on the others.
  virtual bool whole_batch() const { return false; }
  /// Loss [1], mean over images: marks them, distorts them, reads them. Several threads call it at once, each
  /// for one image, unless whole_batch().
  /// @param params  of the owner   @param running  means over the run so far
  /// @param figures  written: those of these images, without the loss
  virtual Var<float> loss(Tape<float>& tape, const Params<float>& params,
                          std::span<const TrainingImage> images, const TrainingFigures& running,
                          TrainingFigures& figures) = 0;
  /// First steps that prepare the networks and are not yet on the mark's own loss.
  virtual Index warm_steps() const { return 0; }
  /// Parameters of networks that training needs and the owner does not keep; null: none.
  virtual ParamStore<float>* helpers() { return nullptr; }
  /// Sets what no gradient moves, such as running statistics of the owner, after each step.
  virtual void finish_step(ParamStore<float>&) {}
  /// Running means for a progress line.
  virtual std::string note(const TrainingFigures& running) const = 0;
  /// Notes every option of training of this kind, so that a checkpoint of other options is refused.
  virtual void describe(RunFingerprint& fingerprint) const = 0;
};

/// A kind of mark: how a message changes colours, how an image is read, how both are trained and stored.
/// A mark holds networks and options, but no parameters: its owner has these and is passed to each call.
class Mark {
 public:
  virtual ~Mark() = default;
  /// Preset that makes this kind of mark, as OWNER stores it.
  virtual std::string preset() const = 0;
  /// The kind's part of the configuration of OWNER: a JSON object, read by stored_mark().
  virtual std::string configuration() const = 0;

  /// Deals the cells to the bits of a message under a key, see deal_cells().
  virtual CellCode code(const CellGrid& cells, const Key& key, Index bits) const;
  /// Colours of the marked field, see nerf::Renderer::set_recolour().
  /// @param owner  must outlive the function   @param signs  of the cells, see cell_signs()
  virtual nerf::Renderer::Recolour recolour(const Owner& owner, std::vector<std::int8_t> signs) const = 0;
  /// Whether Owner::gain scales the mark; otherwise its networks alone decide the mark PSNR.
  virtual bool has_gain() const = 0;
  /// Whether the message lies in cells of the scene: then evidence() finds places, and informed detection
  /// works.
  virtual bool has_cells() const = 0;
  /// Change of colour at sign +1 and gain 1.   @param x  [N, 3] unit cube   @param c  [N, 3] base colours
  /// @return [N, 3]   @throws ValueError without cells
  virtual Var<float> carrier(const Params<float>& params, Var<float> x, Var<float> c) const;

  /// Blind detector reading S_c of every cell.
  /// @param image  [H, W, 3] of the extractor's size   @param places  written unless null, but for the window
  virtual std::vector<double> evidence(const Owner& owner, const Tensor<float>& image,
                                       SeenPlaces* places) const = 0;
  /// Loss [1] of an image [H W, 3], least where the extractor confirms its reading of another image.
  /// @param image  [H, W, 3], the other image   @param owner  must outlive the function
  virtual std::function<Var<float>(Var<float> image)> confirmation(const Owner& owner,
                                                                   const Tensor<float>& image) const = 0;
  /// Prepares training. Owner and views must outlive the result.
  virtual std::unique_ptr<MarkTraining> training(const Owner& owner,
                                                 std::span<const CachedView> views) const = 0;
};

/// Parts of an owner in the making that its mark depends on.
struct MarkSite {
  ParamStore<float>& params;         ///< to which the mark adds "mark/..." and "extractor/..."
  const nerf::RadianceField& field;  ///< unmarked
  const CellGrid& cells;             ///< of the scene, or message_slots()
  Index bits = 0;                    ///< of a message
  std::uint64_t seed = 0;            ///< of the initial parameters
};

/// Makes a mark for an owner.
using MarkMaker = std::function<std::shared_ptr<const Mark>(const MarkSite& site)>;

/// Makes the kind of mark that a configuration of OWNER describes.
/// @throws ValueError if it describes none, or an ablation   @throws nlohmann::json::exception if it is not
/// JSON
MarkMaker stored_mark(const std::string& configuration);

}  // namespace fieldmark::watermark
