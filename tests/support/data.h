#pragma once
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

/// A folder or file below $FIELDMARK_DATA. Where it is missing, says so in the words that tools/test counts,
/// and the test is to return.
inline std::optional<std::filesystem::path> data_or_skip(const std::string& path, const std::string& what) {
  const char* root = std::getenv("FIELDMARK_DATA");
  if (root && *root && std::filesystem::exists(std::filesystem::path(root) / path))
    return std::filesystem::path(root) / path;
  std::cout << "SKIPPED: " << what << " needs FIELDMARK_DATA\n";
  return std::nullopt;
}
