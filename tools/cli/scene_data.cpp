#include "cli/scene_data.h"

#include <CLI/CLI.hpp>

#include "cli/context.h"

namespace fieldmark::cli {

nerf::Dataset load_scene(const std::string& folder, const nerf::DatasetOptions& options, Context& context) {
  nerf::Dataset data = nerf::load_dataset(folder, options);
  for (const auto& note : data.notes) context.note(note);
  return data;
}

}  // namespace fieldmark::cli
