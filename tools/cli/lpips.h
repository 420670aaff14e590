#pragma once
#include <fieldmark/imaging/lpips.h>

#include <optional>
#include <string>

#include "cli/command_line.h"
#include "cli/context.h"

namespace fieldmark::cli {

/// Adds --lpips-weights, the file of the AlexNet weights of LPIPS; empty by default.
void add_lpips_weights(CommandLine& app, std::string& file);

/// Loads LPIPS from `file`, or from $FIELDMARK_DATA/weights if that is empty. Returns nullopt with a note if
/// there is no file, and nullopt for "none".
/// @throws IoError if the file does not contain this network
std::optional<Lpips<float>> load_lpips(LpipsNetwork network, const std::string& file, Context& context);

/// Returns the distance of two images [H, W, 3]; NaN without a network or if the images are too small for it.
double lpips_or_nan(const std::optional<Lpips<float>>& lpips, const Tensor<float>& a, const Tensor<float>& b);

}  // namespace fieldmark::cli
