#pragma once
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/embedding/embedder.h>
#include <fieldmark/watermark/mark/cell_mark.h>
#include <fieldmark/watermark/mark/fusion_mark.h>

#include <array>
#include <variant>

namespace fieldmark::watermark {

/// Presets of `embed`.
///   fast   every cell of the scene carries one bit: trains in minutes
///   paper  one message for all places, after a warm start; distortions of at most 30 degrees, scale 0.75 and
///          blur 0.1. Source: Luo et al. 2023 (CopyRNeRF), sections 3 and 4.1. Departures: images of 80
///          pixels instead of 150, eight per step, noise of at most 0.02, Muon for the extractor's
///          convolutions, and the weights and warm start of PooledTrainingOptions
///   code   preset paper as in its authors' code: the extractor has twice the learning rate, no distortions,
///          samples move by 0.2 of their spacing, N_m is 128, and GlobalMarkOptions::authors_code
inline constexpr std::array<const char*, 3> kPresets{"fast", "paper", "code"};

/// Appearance of a cell mark.
enum class MarkColours {
  blue,   ///< blue and yellow without luma, in fine detail: lost in greyscale
  light,  ///< like uneven lighting: smooth, between blue and grey, fainter on dark colours
  mixed,  ///< in fine detail, between blue and grey: survives changes of colour and strong JPEG
};
/// Returns "blue", "light" or "mixed".
const char* mark_colours_name(MarkColours colours);
/// Parses a name.   @throws ValueError if it is none of these
MarkColours parse_mark_colours(std::string_view name);
/// Returns the colours that suit a scene: mixed for an object in a cube; else light, because such a scene
/// fills its images and shows the mark everywhere.
MarkColours colours_for(nerf::SpaceKind space);
/// Sets bands, axes and shading of the network, and the loss weights of smoothness and of flat areas.
void use_colours(MarkColours colours, CellMarkOptions& mark);

/// Returns the mark PSNR of preset fast that suits a scene, dB:
///   min(P - 10 log10(1 - f), 40), rounded to 0.1, for an object in a cube, else P,   P = 36.5
///   f = mean over the foreground of exp(-(s / 0.03)^2)
/// where s is the standard deviation of green in 5 x 5 pixels. A flat surface hides no mark, so the flat
/// share f of an object adds nothing to the power.
double mark_psnr_for(std::span<const CachedView> views, nerf::SpaceKind space);

/// Returns the images per step of preset fast: two where space is contracted, because thousands of cells need
/// more steps; else four.
Index batch_for(nerf::SpaceKind space);

/// The options of a preset; change them before making an owner.
struct EmbedRecipe {
  OwnerOptions owner{};                                   ///< stored in OWNER
  EmbedViewOptions views{};                               ///< to train on
  EmbedOptions embed{};                                   ///< of training
  std::variant<CellMarkOptions, FusionMarkOptions> mark;  ///< for the preset's kind of mark
  Index cells = 0;  ///< per axis of the scene's cube, 2 to 64; 0: cells_for_message(); unused without cells

  /// Returns the options that only preset fast has.   @throws ValueError naming the preset if it is another
  CellMarkOptions& cell();
  /// Returns the options that only presets paper and code have.
  /// @throws ValueError naming the preset if it is another
  FusionMarkOptions& fusion();
  /// Adapts the options of preset fast to a scene: shape of the extractor's images, colours, batch.
  void suit(const nerf::RadianceField& field);
  /// Sets the mark PSNR of preset fast to that of mark_psnr_for(); other presets keep theirs.
  void suit_mark_psnr(const nerf::RadianceField& field, std::span<const CachedView> cached);
  /// Makes the grid: cells that the views show, or slots.
  CellGrid grid(const nerf::RadianceField& field, std::span<const CachedView> cached) const;
  /// Returns the function that makes the mark.
  MarkMaker maker() const;
  /// Makes the owner whose mark the views will train.
  Owner make(const nerf::RadianceField& field, const std::optional<Key>& key,
             std::span<const CachedView> cached) const {
    return {field, owner, key, grid(field, cached), maker()};
  }
};

/// Returns the recipe of a preset.   @throws ValueError if the name is not in kPresets
EmbedRecipe embed_recipe(std::string_view preset);

}  // namespace fieldmark::watermark
