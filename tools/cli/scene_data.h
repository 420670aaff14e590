#pragma once
#include <fieldmark/nerf/dataset.h>

#include <filesystem>
#include <string>

namespace fieldmark::cli {

class Context;

/// The path of a file or folder in $FIELDMARK_DATA; empty if it or the variable does not exist.
std::filesystem::path shared_data(const std::string& path);

/// nerf::load_dataset(), with its notes passed to the context.
nerf::Dataset load_scene(const std::string& folder, const nerf::DatasetOptions& options, Context& context);

}  // namespace fieldmark::cli
