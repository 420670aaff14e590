#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/sharded_loop.h>
#include <fieldmark/nerf/schedule.h>
#include <fieldmark/watermark/embedding/mark_psnr_meter.h>
#include <fieldmark/watermark/mark/owner.h>
#include <fieldmark/watermark/mark/view_cache.h>

#include <functional>

namespace fieldmark::watermark {

/// What a training image goes through, each drawn anew for every image.
struct EmbedDistortions {
  double noise = 0.08;         ///< largest standard deviation, on two images of three
  double rotation = 35;        ///< largest angle, degrees, on two of three
  double zoom_out = 0.75;      ///< least scale of the window, on two of three ...
  double zoom_in = 1.25;       ///< ... and largest: above 1 the image is a window at a random place
  double blur = 1.3;           ///< largest sigma, pixels of the reader, on one of three
  double sample_shift = 1e-3;  ///< beta of x + z, z ~ N(0, beta^2), cube sides
  /// A batch mixes them, and an image may go through several; false: one kind or none for a whole batch.
  bool mixed = true;
};

/// How mark and extractor are trained.
struct EmbedOptions {
  /// Length of the run and step sizes.
  nerf::ScheduleOptions schedule{
      .seconds = 900, .lr = 2e-3, .half_after = 8000, .cooldown = 0.5, .last = 0.05};
  Index views = 200;            ///< cameras whose geometry is cached, >= 8
  Index batch = 4;              ///< images a step, 1 to 64
  double first_mark_psnr = 28;  ///< dB at the first step; falls towards the owner's strength ...
  double anneal = 200;          ///< ... with this time constant, steps
  double sign_weight = 1;       ///< of the cross-entropy of the signs, place by place
  double index_weight = 0.5;    ///< of the cross-entropy of the cell index
  double bits_weight = 0.5;     ///< of the pooled bits' loss
  double smooth_weight = 0.4;   ///< of the share of the residual's power left after averaging 8 x 8 pixels
  double flat_weight = 0.4;   ///< of the residual's power where the base image is flat, relative to all of it
  double content_weight = 1;  ///< presets paper and code: gamma_1, of the content loss ...
  double message_weight = 5;  ///< ... and gamma_2, of the message loss
  double extractor_lr = 1;    ///< step size of the extractor beside the mark's, > 0
  /// Presets paper and code: makes the marked image [pixels, 3] of a view in place of the owner's colours,
  /// from parameters that its maker added to the owner's; called from several threads at once.
  /// @param message  [1, N_b], -1 or 1
  std::function<Var<float>(Tape<float>& tape, const Params<float>& params, const CachedView& view,
                           Var<float> message)>
      image = {};
  EmbedDistortions distortions = {};  ///< what training images go through
  std::uint64_t seed = 0;             ///< of messages, views and distortions
};

/// Images a step, preset fast: four, but two where space is contracted. There are thousands of cells to
/// tell apart there, and more steps teach more: fox was read to 95.5% blindly after 3,800 steps of two,
/// to 94.9% after 1,900 of four (48 bits, 60 new views, as embedded, one run each).
Index batch_for(nerf::SpaceKind space);

/// The options of a preset: the defaults for fast; for paper a step size of 5e-4 and its distortions at most
/// (noise 0.1, 30 degrees, scale 0.75, blur 0.1).   Source: Luo et al. 2023, section 4.1.
/// For code what the authors' code has in its place: the extractor learns twice as fast, at 1e-3
/// (extractor_lr); an image is one piece at a random place, not a part of changing size (zoom_out, zoom_in);
/// there are no distortions (noise, rotation, blur), of which it would take one kind a run: then noise is of
/// 1e-4, and blur of 0.1 pixels, which changes nothing; samples move by 0.2 of their spacing (sample_shift,
/// for that of RadianceFieldOptions). Left as in preset paper: samples move in all directions and not along
/// the ray about the lower end of their interval, and the length of the run is the schedule's (400,000 steps
/// there).
EmbedOptions embed_options(Preset preset);

/// Trains mark and extractor together on a frozen field (Luo et al. 2023, sec. 3.3 and 3.4, with dense local
/// supervision):
///   L = BCE(sign, s) on the object + 0.5 CE(index, cell) + 0.5 BCE(pooled bits, M)
///     + u (0.4 |mean of 8 x 8 pixels of r|^2 / |r|^2 + 0.4 |r on flat areas|^2 / |r|^2)
/// with the residual r under a budget of power that takes the place of the content loss: the budget says how
/// much is changed, the last two terms keep it where eyes do not look, in fine detail and on texture. u rises
/// from 0 to 1 while the share of right signs goes from 0.7 to 0.8: a mark must be readable before it can
/// hide (with u = 1 from the first step on, signs stayed at 50% for 500 steps). An owner of preset paper
/// or code has the paper's loss in its place:
///   L = gamma_1 mean |P~ - P^|^2 + gamma_2 BCE(pooled bits, M)
/// without the perceptual term and, under a budget, without the content loss. Each image draws a message, a
/// view, distortions; a view of fewer pixels than the reader's is enlarged with its marks, as the reader
/// enlarges a small image. Same seed and number of steps: same bytes, for any thread count and across
/// save() and restore().
class Embedder {
 public:
  /// Owner and views must outlive the embedder.
  /// @param views  see cache_embed_views()
  /// @throws ValueError if an option is out of range, or neither owner nor options say what a message does
  Embedder(Owner& owner, std::span<const CachedView> views, const EmbedOptions& options);
  /// Takes one step. @param seconds  since the start of the run, for a schedule that ends at a time
  void step(double seconds);
  /// Whether the run has all its steps.
  bool done() const { return schedule_.done(steps_); }
  /// Steps taken, those before a restore() included.
  Index steps() const { return steps_; }
  /// Steps that the run will have in all; 0 until a timed run knows.
  Index planned() const { return schedule_.total(); }
  /// Running means over the last images: share of places on the object whose sign is right, whose index is
  /// right (both 0 for presets paper and code), and of bits right, all under training distortions.
  struct Figures {
    double sign = 0;   ///< share of places
    double index = 0;  ///< share of places
    double bits = 0;   ///< share of bits
    double loss = 0;   ///< mean of an image
  };
  /// As of the last step.
  const Figures& figures() const { return figures_; }
  /// Sets the owner's gain so that the mark has the owner's strength on `views` new novel views, each with a
  /// random message, see MarkPsnrMeter; nothing for presets paper and code, which have no gain without a
  /// budget.
  void calibrate(Index views = MarkPsnrViews{}.count);

  /// @throws IoError
  void save(const std::filesystem::path& path) const;
  /// @throws IoError if the file is not a checkpoint of the same configuration
  void restore(const std::filesystem::path& path);
  /// The key of a checkpoint's owner, which a run that goes on must use. @throws IoError
  static Key checkpoint_key(const std::filesystem::path& path);

 private:
  struct Image;
  void find_objects();
  void label_views();
  Image draw(Index image) const;
  float* shifted_positions(Tape<float>& tape, const Image& p) const;
  Var<float> residual(Tape<float>& tape, const Params<float>& params, const Image& p) const;
  Var<float> visibility(Var<float> residual, const Image& p) const;
  Var<float> distort(Tape<float>& tape, Var<float> image, const Image& p) const;
  Var<float> fused_image(Tape<float>& tape, const Params<float>& params, const Image& p,
                         Var<float> message) const;
  double run_dense(const Image& p, Tape<float>& tape, const Params<float>& params, Figures& figures) const;
  double run_pooled(const Image& p, Tape<float>& tape, const Params<float>& params, Figures& figures) const;
  double run_image(Index image, Tape<float>& tape, float* grads, Figures& figures) const;
  void step_parameters();
  std::string fingerprint() const;

  Owner& owner_;
  std::span<const CachedView> views_;
  EmbedOptions options_;
  nerf::Schedule schedule_;
  CounterRng choice_rng_, message_rng_, noise_rng_, shift_rng_;
  CellCode code_;
  std::vector<float> code_matrix_;            // [cells, bits]
  std::vector<Tensor<std::int32_t>> labels_;  // cell of every pixel of every view; count() is background
  std::vector<std::vector<float>> object_;    // 1 where a view's opacity exceeds 0.5
  std::vector<std::vector<float>> colours_;   // of a view's samples as the GlobalMark reads them
  std::vector<std::vector<float>>
      flat_;  // [pixels, 3]: 1 on flat parts of the object, falling to 0 on texture
  ShardedLoop<float> loop_;
  Adam<float> adam_;
  Figures figures_;
  Index steps_ = 0;
};

}  // namespace fieldmark::watermark
