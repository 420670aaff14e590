#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/sharded_loop.h>
#include <fieldmark/nerf/radiance_field.h>
#include <fieldmark/nerf/schedule.h>

namespace fieldmark::nerf {

/// How a field is trained.
struct TrainOptions {
  ScheduleOptions schedule{};      ///< length of the run and step sizes
  Index samples_per_step = 24576;  ///< rays a step are chosen to have about this many samples (of both
                                   ///< networks of an mlp field), >= 1024
  /// Of a hash field's first steps, >= 1024 (never more than samples_per_step): early on, four small steps
  /// teach more than a large one (docs/results/training.md has 24576 from the first step on beside it).
  /// Hashed levels still take a step only once in samples_per_step samples, by turns, since theirs costs as
  /// much for few samples as for many.
  Index first_samples = 6144;
  /// Rays of a step, >= 64, however many samples they have: of the first steps of a scene without bounds,
  /// where a ray has hundreds, that is what decides how long they take.
  Index least_rays = 512;
  double grow_after = 1000;  ///< steps, above 0; from then on first_samples grows with the number of the step
  double huber = 0.1;        ///< see PhotometricLossOptions
  float stop = 1e-2f;  ///< a ray ends where its transmittance falls below this, in [0, 1): what lies deeper
                       ///< than 1e-2 is worth less than the rays that its samples would cost
  /// Weight of distortion_loss() beside photometric_loss(), in sides of the scene's cube, >= 0: thins the fog
  /// that photographs alone leave where they say little. Of hash fields.
  double distortion = 0;
  /// Share of the rays, 0 to 1, that are the harder of two: those whose tile of 8 x 8 pixels was last seen
  /// with the larger error. Of hash fields.
  double hard_pixels = 0.75;
  /// Weight decay of the hash table, >= 0 (AdamRange::weight_decay): a number falls with every step that it
  /// takes, so that what photographs say little of, and a long run learns by heart, does not grow.
  double table_decay = 0.1;
  Index decay_after = 2000;  ///< steps, >= 0, without table_decay: at first the table has to grow
  /// Steps, >= 0, after which the pixels of a field with supersampling (RadianceFieldOptions) are means of
  /// that many rays, each anywhere in its part of the pixel; before, where there is more to learn of more
  /// pixels than of their edges, one ray through the centre. Of hash fields.
  Index supersample_after = 8000;
  Index warm_up = 32;      ///< steps before cells may be declared empty
  std::uint64_t seed = 0;  ///< of the choice of rays, backgrounds and occupancy samples
  /// bf16 rounds what the networks multiply, forward and in dX; weights, their gradients and the table stay
  /// float. Needs bf16_units(). No faster for networks as narrow as these.
  Precision precision = Precision::fp32;
  /// Where photographs have alpha, rule out for good what their silhouettes show to be empty: no sample is
  /// spent there. A departure from the original mlp field, whose rays have their points anywhere.
  bool carve = true;
  /// Go on with a field that has been trained: its cameras, background, bounds and space stay, and of its
  /// cells only those are looked at again that are occupied. Nothing is carved.
  bool keep = false;
};

/// What suits a kind of field. mlp: Adam with 5e-4, falling exponentially over the last nine tenths of the
/// run to a tenth, see ScheduleOptions; 64 rays a step at the default 96 samples each, since many small steps
/// teach it more than a few large ones. A much larger step size may never leave the empty image.
TrainOptions train_options(FieldKind kind);

/// Sizes of a hash field that a run of this length can fill: those of RadianceFieldOptions; for runs of at
/// most 120 seconds or 8000 steps a table of 2^17 rows and a finest level of 512 cells, whose steps are
/// faster (docs/results/training.md has both beside each other); for runs of more than 400 seconds or 20000
/// steps a table of 2^19 rows, a finest level of 1024 cells, networks of 64 and samples 1 / 512 of a diagonal
/// apart.
RadianceFieldOptions field_options(const ScheduleOptions& length);

/// Sizes of the field that a Trainer::save() is of: a run whose sizes were found once goes on with them.
/// @throws IoError if the file is no checkpoint of a field's training
RadianceFieldOptions checkpointed_field(const std::filesystem::path& path);

/// Trains a radiance field on photographs (Mildenhall et al. 2020, sec. 5; Mueller et al. 2022): random rays
/// of all photographs (where they have alpha: of the silhouettes and a margin), random backgrounds behind
/// alpha, Adam, occupancy refreshed as densities form.
///
/// A step is a parallel loop over chunks of 64 rays (ShardedLoop); the gradient at the encoding's output is
/// kept for the whole batch, and one pass over the levels, each owned by one thread, adds it to the table. Of
/// an mlp field both networks learn, each from its own loss over the same rays; a chunk is of 4 rays.
/// Same seed and number of steps: same bytes, for any thread count and across save() and restore(). Once the
/// buffers have grown with the samples of a step, a step allocates nothing.
class Trainer {
 public:
  /// Lays the scene into the field's cube, see scene_space(). Where photographs have alpha, tightens its
  /// bounds to their visual hull and rules out the cells outside it; in other spaces, the cells that no
  /// camera sees; unless the field is to keep what it has. Field and data must outlive the trainer. @throws
  /// ValueError if an option is out of range
  Trainer(RadianceField& field, const Dataset& data, const TrainOptions& options);
  /// Clears the gradients that the table has not been stepped with yet.
  ~Trainer();

  /// Takes one step. @param seconds  since the start of the run, for a schedule that ends at a time
  void step(double seconds);
  /// Whether the run has all its steps.
  bool done() const { return schedule_.done(steps_); }
  /// Steps taken, those before a restore() included.
  Index steps() const { return steps_; }
  /// Steps that the run will have in all; 0 until a timed run knows.
  Index planned() const { return schedule_.total(); }
  /// Whether a timed run's plan was changed since it began or was restored, see Schedule: given as steps, its
  /// number of steps gives other bytes.
  bool replanned() const { return schedule_.replanned(); }
  /// Mean loss of the last steps over whole photographs, as the PSNR of the same mean square; of the rays
  /// chosen, which hard_pixels makes harder than the rest.
  double train_psnr() const;
  /// Samples that passed through the networks so far.
  double samples() const { return samples_; }

  /// All that the next step depends on, into a file (a checkpoint). @throws IoError
  void save(const std::filesystem::path& path) const;
  /// @throws IoError if the file is not a checkpoint of the same configuration and data
  void restore(const std::filesystem::path& path);

 private:
  struct Shard;
  void lay_out_space();
  void carve();
  Index all_pixels() const;
  Index tile_of(Index place) const;
  void prefer_hard(Index first, Index count, std::span<Index> place) const;
  Index rays_along_pixel() const;
  void choose_rays(Index first, Index rays, Shard& c) const;
  void aim(Index first, Shard& c) const;
  void note_errors(Var<float> rays, Shard& c) const;
  double step_hash();
  double run_chunk(Index index, Shard& shard, Tape<float>& tape, float* grads);
  Index mlp_rays() const;
  double step_mlp();
  double run_mlp_chunk(Index index, Shard& shard, Tape<float>& tape, float* grads);
  double wanted_samples() const;
  bool level_steps(int level) const;
  void backward_table();
  void refresh_occupancy();
  std::string fingerprint() const;

  RadianceField& field_;
  const Dataset& data_;
  TrainOptions options_;
  Schedule schedule_;
  CounterRng pixel_rng_, background_rng_, occupancy_rng_, second_rng_, place_rng_;
  PackedWeights<float> packed_;
  ShardedLoop<float> loop_;
  Adam<float> adam_;
  std::vector<std::uint32_t> pixels_;  // worth a ray; empty: all are
  std::vector<float> tile_errors_;     // mean squares last seen, of tiles of all photographs; see hard_pixels
  std::vector<Shard> shards_;
  Index steps_ = 0, rays_per_step_;
  double samples_ = 0, smoothed_loss_ = -1;
};

}  // namespace fieldmark::nerf
