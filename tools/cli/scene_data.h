#pragma once
#include <fieldmark/nerf/dataset.h>

#include <string>

namespace fieldmark::cli {

class Context;

/// nerf::load_dataset(), and the notes of what it read.
nerf::Dataset load_scene(const std::string& folder, const nerf::DatasetOptions& options, Context& context);

}  // namespace fieldmark::cli
