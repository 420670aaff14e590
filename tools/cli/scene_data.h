#pragma once
#include <fieldmark/nerf/dataset.h>

#include <filesystem>
#include <string>

namespace fieldmark::cli {

class Context;

/// A file or folder below $FIELDMARK_DATA; empty where the variable is unset or has none of that name.
std::filesystem::path shared_data(const std::string& path);

/// nerf::load_dataset(), and the notes of what it read.
nerf::Dataset load_scene(const std::string& folder, const nerf::DatasetOptions& options, Context& context);

}  // namespace fieldmark::cli
