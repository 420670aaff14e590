#pragma once
#include <fieldmark/core/error.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

namespace fieldmark {

/// A temporary folder that only its owner can access, removed at the end of the scope.
struct PrivateFolder {
  /// @param what  part of its name   @throws IoError if it cannot be made
  explicit PrivateFolder(const std::string& what) {
    // mkdtemp() replaces six X's at the end.
    std::string name =
        (std::filesystem::temp_directory_path() / ("fieldmark_" + what + "_" + std::string(6, 'X'))).string();
    if (!::mkdtemp(name.data())) throw IoError(name + ": cannot be made (" + std::strerror(errno) + ")");
    path = name;
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  ~PrivateFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  std::filesystem::path operator/(const std::string& name) const { return path / name; }
  std::filesystem::path path;
};

}  // namespace fieldmark
