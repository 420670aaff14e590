#include "cli/shared_data.h"

#include <cstdlib>

namespace fieldmark::cli {

std::filesystem::path shared_data(const std::string& path) {
  const char* root = std::getenv("FIELDMARK_DATA");
  if (!root || !*root) return {};
  const std::filesystem::path found = std::filesystem::path(root) / path;
  return std::filesystem::exists(found) ? found : std::filesystem::path{};
}

}  // namespace fieldmark::cli
