#pragma once
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/embedding/recipe.h>

#include <string>
#include <vector>

namespace fieldmark::bench {

/// One way of embedding a mark: what differs from the default, and the settings themselves.
struct EmbedVariant {
  std::string choice;                 ///< what is chosen: "patch", "cells", ...; "default" for the default
  std::string setting;                ///< how, for people
  watermark::EmbedRecipe recipe;      ///< options of owner, mark and training, the seed included
  watermark::EmbedViewOptions views;  ///< what it is trained on
};

/// The default first, then other lengths of the run, then every choice that embedding makes, switched off or
/// set otherwise.
/// @param length  of a run: its steps and seconds are kept   @param bits  of a message
/// @param colours  that the scene's default is, see watermark::colours_for()
std::vector<EmbedVariant> embed_variants(const ScheduleOptions& length, Index bits, std::uint64_t seed,
                                         watermark::MarkColours colours = watermark::MarkColours::blue);

}  // namespace fieldmark::bench
