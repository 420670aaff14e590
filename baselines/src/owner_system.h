#pragma once
#include <fieldmark/baselines/cell.h>
#include <fieldmark/baselines/mark_scores.h>
#include <fieldmark/baselines/timed_run.h>
#include <fieldmark/watermark/embedding/recipe.h>

namespace fieldmark::baselines {

/// A part of a system that an ablation takes away or replaces.
enum class Ablation {
  none,
  unkeyed_signs,        ///< cells: each shows its bit as it is
  no_message_features,  ///< fusion: no D, the message itself enters G
  no_colour_features,   ///< fusion: no E, the colour alone enters G
  power_budget,         ///< fusion: the residual has our power budget in place of the content loss
  message_in_inputs,    ///< a MessageField with MessagePlace::inputs
  message_in_density    ///< a MessageField with MessagePlace::density
};

/// How a system with an Owner is trained.
struct OwnerSystem {
  watermark::EmbedRecipe recipe;       ///< options, without the length of the run
  Ablation ablation = Ablation::none;  ///< of the recipe's mark
  double test_shift = 0;  ///< DRS: samples are moved so far at test too, see EmbedDistortions::sample_shift
};
/// Makes the system's mark.
watermark::MarkMaker mark_maker(const OwnerSystem& system);

/// Whether a system of paper_systems() is trained through an Owner.
bool has_owner(std::string_view system);
/// The options of such a system: ours at 34 dB on the object, read at up to 128 pixels; the paper's at up to
/// 150. Systems without one of their parts:
///   ours_without_dense: signs and cells of places cost nothing, the pooled bits alone do
///   ours_without_cells: preset paper's networks under our power budget, distortions and step sizes; without
///   cells there is nothing dense to supervise
///   ours_without_signs, without_mff, without_cff, nerf_message, geometry: see Ablation
///   without_drr: neither distortions nor moved samples
///   drs: the full method, with the samples moved at test as in training
/// @param image  pixels of the views' longer side; the reader sees no more, and at least 32
/// @throws ValueError if the system has none
OwnerSystem owner_system(const CellName& name, Index image);

/// A key for measurements, a function of the seed: not secret, so that equal runs give equal cells.
watermark::Key measuring_key(std::uint64_t seed);

/// Where and how long an owner is trained.
struct OwnerTraining {
  double seconds = 300;              ///< of training, without the views' rendering; where steps is 0
  Index steps = 0;                   ///< of training, 0: by time
  std::filesystem::path checkpoint;  ///< see timed_run()
  Index views = 200;                 ///< novel views to learn from
  RunProgress progress = {};         ///< may be empty
};

/// An owner that has been trained.
struct TrainedOwner {
  watermark::Owner owner;  ///< calibrated
  double test_shift = 0;   ///< see OwnerSystem
  Index steps = 0;         ///< of training
  double seconds = 0;      ///< of training
  std::string curve = {};  ///< see TrainingRun::curve()
};

/// The cell whose training a system's is: drs trains as copyrnerf_paper does.
CellName trained_as(const CellName& name);

/// Renders views, trains mark and extractor and calibrates the mark PSNR; resumes from a checkpoint.
/// @throws Stopped after saving   @throws as Embedder
TrainedOwner train_owner(const nerf::RadianceField& field, const CellName& name, const OwnerSystem& system,
                         const OwnerTraining& training);

/// An owner's mark with a message of its own in every view, see message_of_view(). `marked` must outlive it.
MarkedScene marked_scene(const TrainedOwner& marked, std::uint64_t seed,
                         const nerf::RenderOptions& options = {});

/// The owner with Gaussian noise on every weight of the field's networks and table and of the mark's
/// networks; the extractor stays.
/// @param deviation  of the noise, >= 0   @throws ValueError if it is negative
watermark::Owner with_noisy_weights(const watermark::Owner& owner, double deviation, std::uint64_t seed);

}  // namespace fieldmark::baselines
