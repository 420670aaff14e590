#pragma once
#include <filesystem>
#include <string>

namespace fieldmark::cli {

/// Returns the path of a file or folder in $FIELDMARK_DATA; empty if it or the variable does not exist.
std::filesystem::path shared_data(const std::string& path);

}  // namespace fieldmark::cli
