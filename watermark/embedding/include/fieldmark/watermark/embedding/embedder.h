#pragma once
#include <fieldmark/engine/sharded_loop.h>
#include <fieldmark/engine/training_run.h>
#include <fieldmark/watermark/embedding/mark_psnr_meter.h>
#include <fieldmark/watermark/mark/owner.h>

namespace fieldmark::watermark {

/// Distortions of training images, drawn anew for every image.
struct EmbedDistortions {
  double noise = 0.08;         ///< largest standard deviation, on two of three images
  double rotation = 35;        ///< largest angle, degrees, on two of three images
  double zoom_out = 0.75;      ///< smallest scale, on two of three images ...
  double zoom_in = 1.25;       ///< ... and largest: above 1 the image is cut at a random place
  double blur = 1.3;           ///< largest sigma, pixels of the extractor's image, on one of three images
  double sample_shift = 1e-3;  ///< beta of x + z, z ~ N(0, beta^2), cube sides
  bool mixed = true;           ///< an image takes several kinds; false: a whole batch takes one kind or none
};

inline constexpr double kEmbedBeta2 = 0.99;  ///< beta_2 of Adam in Embedder

class DistortedViews;

/// Training options shared by every kind of mark.
struct EmbedOptions {
  /// Length of the run and step sizes.
  ScheduleOptions schedule{.seconds = 300, .lr = 2e-3, .half_after = 8000, .cooldown = 0.5, .last = 0.05};
  Index batch = 4;                    ///< images per step, 1 to 64
  double extractor_lr = 1;            ///< learning rate of the extractor relative to the mark's, > 0
  EmbedDistortions distortions = {};  ///< of training images
  std::uint64_t seed = 0;             ///< of messages, views and distortions
};

/// Trains mark and extractor together on a frozen field.
/// Each image draws a code of the cells, a message, a view and distortions; the mark computes its loss (see
/// Mark::training()), and Adam minimises the mean over a batch, with Muon for the weights that the mark names
/// (MarkTraining::matrices()). The owner's key takes no part: equal options train equal networks under any
/// key, and the evidence that they find is independent of it. An image with fewer pixels than the extractor's
/// is enlarged with its mark, as small images are for reading. The same seed and number of steps give the
/// same bytes, for any thread count and across save() and restore(). Source: Luo et al. 2023 (CopyRNeRF),
/// section 3.4.
class Embedder final : public TrainingRun {
 public:
  /// Owner and views must outlive the embedder.
  /// @param views  see cache_embed_views()
  /// @throws ValueError if an option is out of range
  Embedder(Owner& owner, std::span<const CachedView> views, const EmbedOptions& options);
  ~Embedder() override;
  /// Running means over the last images.
  using Figures = TrainingFigures;
  /// Running means over the last images.
  const Figures& figures() const { return figures_; }
  /// Number of warm-up steps; a shorter run has not trained on the mark's own loss.
  Index warm_steps() const { return training_->warm_steps(); }
  double figure() const override { return figures_.bits; }
  std::string status() const override { return training_->note(figures_); }
  /// Sets the owner's gain so that novel views, each with a random message, have its mark PSNR (see
  /// MarkPsnrMeter), and measures the strengths by which its cells are dealt (see CellDealer). Does nothing
  /// for a mark without a gain.
  void calibrate(Index views = MarkPsnrViews{}.count);

  /// Returns the key of a checkpoint's owner, which a resumed run must use. @throws IoError, also if it holds
  /// none
  static Key checkpoint_key(const std::filesystem::path& path);

 private:
  double take_step(double seconds) override;
  void describe(RunFingerprint& fingerprint) const override;
  // A checkpoint holds the owner's key, if it has one: the file is secret, and restoring under another fails.
  void save_more(SafetensorsFile& file) const override;
  void restore_more(const SafetensorsFile& file) override;
  void write(const SafetensorsFile& file, const std::filesystem::path& path) const override {
    file.write(path, Access::secret);
  }
  CellCode fresh_code(std::uint64_t place) const;
  TrainingImage draw(Index image, Tape<float>& tape) const;
  double run_image(Index image, Tape<float>& tape, float* grads, Figures& figures) const;
  double run_batch(Figures& figures);

  Owner& owner_;
  std::span<const CachedView> views_;
  EmbedOptions options_;
  CellGrid cells_;  // the owner's, without strengths
  CounterRng message_rng_;
  std::unique_ptr<DistortedViews> drawn_;
  std::unique_ptr<MarkTraining> training_;
  ShardedLoop<float> loop_;
  Figures figures_;
};

}  // namespace fieldmark::watermark
