#pragma once
#include <fieldmark/watermark/mark/fusion_mark.h>

#include <string>

#include "cli/context.h"

namespace fieldmark::cli {

/// Loads the VGG-16 features of a perceptual term from `file`, or from $FIELDMARK_DATA/weights if that is
/// empty, and prints the depth that they reach.
/// @throws UsageError if there is no file   @throws IoError if the file does not contain this network
watermark::PerceptualTerm load_perceptual_term(double weight, const std::string& file, Context& context);

}  // namespace fieldmark::cli
