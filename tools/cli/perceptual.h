#pragma once
#include <fieldmark/imaging/lpips.h>

#include <optional>
#include <string>

#include "cli/command_line.h"
#include "cli/context.h"

namespace fieldmark::cli {

/// Adds --lpips-weights, the file of AlexNet's weights for LPIPS; empty where it is not given.
void add_lpips_weights(CommandLine& app, std::string& file);

/// A network for LPIPS from `file`, or, where that is empty, from the file of that network below
/// $FIELDMARK_DATA/weights. Without either, and where `file` is "none", there is none, and people are told.
/// @throws IoError if a file that is given or there is no network's
std::optional<Lpips<float>> load_lpips(LpipsNetwork network, const std::string& file, Context& context);

/// The distance of two images [H, W, 3]; NaN without a network and where they are too small for it.
double lpips_or_nan(const std::optional<Lpips<float>>& lpips, const Tensor<float>& a, const Tensor<float>& b);

}  // namespace fieldmark::cli
