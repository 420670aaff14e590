#pragma once
#include <fieldmark/engine/sharded_loop.h>
#include <fieldmark/engine/training_run.h>
#include <fieldmark/nerf/radiance_field.h>

#include <memory>

namespace fieldmark::nerf {

class ImageCorrections;

/// Options for training a field.
struct TrainOptions {
  ScheduleOptions schedule{};      ///< length of the run and step sizes
  Index samples_per_step = 24576;  ///< samples per step, >= 1024: sets the number of rays (for an mlp field:
                                   ///< samples of both networks)
  /// Samples per step at the start of a hash field's training, >= 1024, at most samples_per_step: early on,
  /// four small steps teach more than a large one (docs/results/training.md). Hashed levels still take a step
  /// only once per samples_per_step samples, in turn, because their step takes as long for few samples as for
  /// many.
  Index first_samples = 6144;
  /// Minimum rays per step, a multiple of 64, however many samples they have: in an unbounded scene the first
  /// rays have hundreds.
  Index least_rays = 512;
  double grow_after = 1000;  ///< steps, > 0, after which first_samples grows with the step number
  double huber = 0.1;        ///< see PhotometricLossOptions
  float stop = 1e-2f;        ///< transmittance threshold at which a ray ends, in [0, 1)
  /// Weight of distortion_loss(), in sides of the scene's cube, >= 0: thins fog. Hash fields only.
  double distortion = 0;
  /// Share of the rays, 0 to 1, that go through the harder of two pixels: the one whose tile of 8 x 8 pixels
  /// had the larger error when last seen. Hash fields only.
  double hard_pixels = 0.75;
  /// Weight decay of the hash table, >= 0 (AdamRange::weight_decay): an entry shrinks at each of its steps,
  /// so that a long run does not overfit where training images constrain little.
  double table_decay = 0.1;
  Index decay_after = 2000;  ///< first steps, >= 0, without table_decay: the table must grow first
  /// First steps, >= 0, with one ray a pixel; later a pixel is the mean of one ray
  /// through each of its parts (RadianceFieldOptions::supersampling). Hash fields only.
  Index supersample_after = 8000;
  Index warm_up = 32;      ///< steps before cells may be declared empty
  std::uint64_t seed = 0;  ///< of rays, backgrounds and occupancy samples
  /// bf16 rounds the factors of the networks' products, forward and in dX; weights, their gradients and the
  /// table stay fp32. Needs bf16_units(). No faster for networks this narrow.
  Precision precision = Precision::fp32;
  /// If training images have alpha, permanently rules out the cells outside their silhouettes. Departure from
  /// the original mlp field, which samples whole rays.
  bool carve = true;
  /// Continues the training of a trained field: its cameras, background, bounds and space stay unchanged, and
  /// only its occupied cells are re-examined. Nothing is carved.
  bool keep = false;
  /// Learns the exposure and white balance of each training image, as a colour_affine() before the loss.
  /// Their mean stays the identity, so the field keeps the mean exposure.
  bool image_colours = false;
  /// Learns a small motion of each training camera (on the order of degrees, and of hundredths of its
  /// distance) together with the field, from step 100 on. The mean motion stays zero. Nothing is carved,
  /// because silhouettes of displaced cameras would cut into the object. The gradient ignores that colour
  /// changes with the viewing direction, as in Tancik et al. 2023 (Nerfstudio). Hash fields only.
  bool refine_poses = false;
  /// Learns only image_colours and refine_poses while the field stays fixed; their means are free. Needs
  /// keep. Hash fields only.
  bool freeze = false;
};

/// Returns the defaults for a kind of field. mlp: Adam with a step size of 5e-4, which falls exponentially to
/// a tenth over the last nine tenths of the run; 64 rays per step with 96 samples each. With a much larger
/// step size, training may never leave the empty image.
TrainOptions train_options(FieldKind kind);

/// Returns the sizes of a hash field that a run of this length can fill. Up to 120 seconds or 8000 steps: a
/// table of 2^17 rows and a finest level of 512 cells, whose steps are faster (docs/results/training.md).
/// Above 400 seconds or 20000 steps: 2^19 rows, 1024 cells, networks 64 wide, samples 1 / 512 of a diagonal
/// apart. Between: the defaults.
RadianceFieldOptions field_options(const ScheduleOptions& length);

/// Returns the field sizes in a trainer's checkpoint, so that a run whose sizes were searched resumes with
/// them.
/// @throws IoError if the file is not a checkpoint of a field
RadianceFieldOptions checkpointed_field(const std::filesystem::path& path);

/// Trains a radiance field (Mildenhall et al. 2020, sec. 5; Mueller et al. 2022): random rays through valid
/// pixels of all training images (with alpha: through the silhouettes and a margin), random backgrounds
/// behind alpha, Adam, and an occupancy grid refreshed as densities form.
///
/// A step is a parallel loop over chunks of 64 rays (ShardedLoop). The gradient at the encoding's output is
/// kept for the whole batch, and one pass over the levels, each owned by one thread, adds it to the table. An
/// mlp field trains both networks, each by its own loss over the same rays, in chunks of 4 rays.
/// Results are byte-identical for any number of threads. Once the buffers have grown, a step allocates
/// nothing.
class Trainer final : public TrainingRun {
 public:
  /// Places the scene in the field's cube, see scene_space(). With alpha, tightens the bounds to the visual
  /// hull and rules out the cells outside it; in other spaces, rules out the cells that no camera sees. Does
  /// neither with TrainOptions::keep. Field and data must outlive the trainer.
  /// @throws ValueError if an option is out of range
  Trainer(RadianceField& field, const Dataset& data, const TrainOptions& options);
  /// Clears the gradients of rows whose step is still due.
  ~Trainer() override;

  /// Returns the running mean of the loss as a PSNR over whole training images. It is measured on the chosen
  /// rays, which hard_pixels makes harder than average.
  double train_psnr() const;
  /// Returns the cameras of the training images, as refined so far with TrainOptions::refine_poses.
  std::vector<Camera> cameras() const;
  /// Returns the colour maps [V, 12] learnt so far with TrainOptions::image_colours, see colour_affine();
  /// else empty.
  std::span<const float> image_colours() const;
  /// Samples that passed through the networks so far.
  double samples() const { return samples_; }
  double figure() const override { return train_psnr(); }
  std::string status() const override;

 private:
  struct Shard;
  double take_step(double seconds) override;
  void describe(RunFingerprint& fingerprint) const override;
  void save_more(SafetensorsFile& file) const override;
  void restore_more(const SafetensorsFile& file) override;
  std::optional<SafetensorsFile> converted(const SafetensorsFile& file) const override;
  void lay_out_space();
  void carve();
  void choose_pixels();
  Index all_pixels() const;
  Index tile_of(Index place) const;
  void prefer_hard(Index first, Index count, std::span<Index> place) const;
  Index rays_along_pixel() const;
  void choose_rays(Index first, Index rays, Shard& c) const;
  void aim(Index first, Shard& c) const;
  void note_errors(Var<float> rays, Shard& c) const;
  void prepare_images();
  void place_cameras();
  Var<float> coloured(Var<float> pixels, Shard& c) const;
  void add_motions(const float* ddensity, const float* dcolour, Shard& c) const;
  void step_images();
  double step_hash();
  double run_chunk(Index index, Shard& shard, Tape<float>& tape, float* grads);
  Index mlp_rays() const;
  double step_mlp();
  double run_mlp_chunk(Index index, Shard& shard, Tape<float>& tape, float* grads);
  double wanted_samples() const;
  bool level_steps(int level) const;
  void backward_table();
  void refresh_occupancy();

  RadianceField& field_;
  const Dataset& data_;
  TrainOptions options_;
  CounterRng pixel_rng_, background_rng_, occupancy_rng_, second_rng_, place_rng_;
  PackedWeights<float> packed_;
  ShardedLoop<float> loop_;
  std::vector<std::uint32_t> pixels_;  // that get rays; empty: all do
  Index valid_pixels_ = 0;             // of all training images
  std::vector<float> tile_errors_;  // last mean squares of the tiles of all training images, see hard_pixels
  std::vector<Shard> shards_;
  std::unique_ptr<ImageCorrections> images_;  // null: no corrections are learnt
  std::vector<Camera> cameras_;               // of the training images, at the current step
  std::string start_;                         // SHA-256 of a field that is kept
  Index rays_per_step_;
  double samples_ = 0;
};

}  // namespace fieldmark::nerf
