#pragma once
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

/// Returns the path of a file or folder below $FIELDMARK_DATA. If it is missing, prints the message that
/// tools/test counts and returns nothing; the test must then return.
inline std::optional<std::filesystem::path> data_or_skip(const std::string& path, const std::string& what) {
  const char* root = std::getenv("FIELDMARK_DATA");
  if (root && *root && std::filesystem::exists(std::filesystem::path(root) / path))
    return std::filesystem::path(root) / path;
  std::cout << "SKIPPED: " << what << " needs FIELDMARK_DATA\n";
  return std::nullopt;
}
