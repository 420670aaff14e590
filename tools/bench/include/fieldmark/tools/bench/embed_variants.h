#pragma once
#include <fieldmark/watermark/embedding/recipe.h>

#include <string>
#include <vector>

namespace fieldmark::bench {

/// One way of embedding a mark: its difference from the default, and the settings themselves.
struct EmbedVariant {
  std::string choice;             ///< the option varied: "patch", "cells", ...; "default" for the default
  std::string setting;            ///< its value, for display
  watermark::EmbedRecipe recipe;  ///< options of owner, views, mark and training, including the seed
};

/// Returns the default first, then other run lengths, then each choice in embedding, switched off or changed.
/// @param length  of a run: its steps and seconds are kept   @param bits  length of a message
/// @param colours  the scene's default, see watermark::colours_for()
std::vector<EmbedVariant> embed_variants(const ScheduleOptions& length, Index bits, std::uint64_t seed,
                                         watermark::MarkColours colours = watermark::MarkColours::blue);

}  // namespace fieldmark::bench
