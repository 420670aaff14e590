#include "cli/scene_data.h"

#include <cstdlib>

#include "cli/context.h"

namespace fieldmark::cli {

std::filesystem::path shared_data(const std::string& path) {
  const char* root = std::getenv("FIELDMARK_DATA");
  if (!root || !*root) return {};
  const std::filesystem::path found = std::filesystem::path(root) / path;
  return std::filesystem::exists(found) ? found : std::filesystem::path{};
}

nerf::Dataset load_scene(const std::string& folder, const nerf::DatasetOptions& options, Context& context) {
  nerf::Dataset data = nerf::load_dataset(folder, options);
  for (const auto& note : data.notes) context.note(note);
  return data;
}

}  // namespace fieldmark::cli
