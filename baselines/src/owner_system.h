#pragma once
#include <fieldmark/baselines/cell.h>
#include <fieldmark/baselines/mark_scores.h>
#include <fieldmark/baselines/timed_run.h>
#include <fieldmark/watermark/embedding/recipe.h>

namespace fieldmark::baselines {

/// A part of a system that an ablation removes or replaces.
enum class Ablation {
  none,
  unkeyed_signs,        ///< cells: each shows its bit unchanged
  no_message_features,  ///< fusion: no D; G receives the message itself
  no_colour_features,   ///< fusion: no E; G receives the colour alone
  power_budget,         ///< fusion: our power budget on the residual instead of the content loss
  message_in_inputs,    ///< a MessageField with MessagePlace::inputs
  message_in_density    ///< a MessageField with MessagePlace::density
};

/// Options for training a system with an Owner.
struct OwnerSystem {
  watermark::EmbedRecipe recipe;       ///< options without the run length
  Ablation ablation = Ablation::none;  ///< of the recipe's mark
  double test_shift = 0;  ///< DRS: shift of the samples at test time, see EmbedDistortions::sample_shift
};
/// Returns the factory of the system's mark.
watermark::MarkMaker mark_maker(const OwnerSystem& system);

/// True if a system of paper_systems() is trained through an Owner.
bool has_owner(std::string_view system);
/// Returns the options of such a system: ours at 34 dB on the object, read at up to 128 pixels; the paper's
/// at up to 150. Systems with a part removed:
///   ours_without_dense: no loss on signs and cells of places, only on the pooled bits
///   ours_without_cells: preset paper's networks under our power budget, distortions and step sizes; without
///   cells there is no dense supervision
///   ours_without_signs, without_mff, without_cff, nerf_message, geometry: see Ablation
///   cold_start: no warm start
///   without_drr: neither distortions nor shifted samples
///   drs: the full method, with the samples shifted at test time as in training
/// @param image  longer side of the views in pixels; the reader sees at most that, and at least 32
/// @throws ValueError if the system has no Owner
OwnerSystem owner_system(const CellName& name, Index image);

/// Returns a key for measurements, derived from the seed: not secret, so that equal runs give equal cells.
watermark::Key measuring_key(std::uint64_t seed);

/// Data and duration of an owner's training.
struct OwnerTraining {
  double seconds = 300;              ///< of training, without rendering the views; used if steps is 0
  Index steps = 0;                   ///< of training; 0: by time
  std::filesystem::path checkpoint;  ///< see timed_run()
  Index views = 200;                 ///< novel views to train on
  RunProgress progress = {};         ///< may be empty
};

/// A trained owner.
struct TrainedOwner {
  watermark::Owner owner;  ///< calibrated
  double test_shift = 0;   ///< see OwnerSystem
  Index steps = 0;         ///< of training
  double seconds = 0;      ///< of training
  std::string curve = {};  ///< see TrainingRun::curve()
};

/// Returns the cell whose training a system uses: drs trains as copyrnerf_paper does.
CellName trained_as(const CellName& name);

/// Renders views, trains mark and extractor, and calibrates the mark PSNR; resumes from a checkpoint.
/// @throws Stopped after saving   @throws as Embedder
TrainedOwner train_owner(const nerf::RadianceField& field, const CellName& name, const OwnerSystem& system,
                         const OwnerTraining& training);

/// Marks every view with its own message, see message_of_view(). `marked` must outlive the result.
MarkedScene marked_scene(const TrainedOwner& marked, std::uint64_t seed,
                         const nerf::RenderOptions& options = {});

/// Returns the owner with Gaussian noise on every weight of the field's networks and table and of the mark's
/// networks; the extractor is unchanged.
/// @param deviation  of the noise, >= 0   @throws ValueError if it is negative
watermark::Owner with_noisy_weights(const watermark::Owner& owner, double deviation, std::uint64_t seed);

}  // namespace fieldmark::baselines
