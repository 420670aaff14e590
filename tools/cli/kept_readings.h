#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "cli/reading.h"

namespace fieldmark::cli {

/// What images showed, kept in a file, so that a command which was stopped need not read them again. The file
/// has a line of JSON with owner, detection and instruction set, then one for each image with the SHA-256 of
/// its bytes. A last line that was cut off is dropped.
class KeptReadings {
 public:
  /// Reads the file, or begins it with the owner's number of cells. Nothing is written to a file that is something else.
  /// @throws IoError     if it cannot be read or written, or is no such file
  /// @throws UsageError  if it is of another owner, detection or instruction set
  KeptReadings(const std::filesystem::path& file, const std::string& owner_sha256,
               const std::string& detection, Index cells);

  /// What an image of these bytes showed, without its name and file; none if it has not been read.
  std::optional<ImageEvidence> find(const std::string& sha256) const;
  /// Writes what an image showed to the end of the file. @throws IoError
  void add(const ImageEvidence& read);
  /// Images in the file.
  std::size_t size() const { return readings_.size(); }

 private:
  void append(const std::string& line) const;
  std::filesystem::path file_;
  std::map<std::string, ImageEvidence> readings_;  // by SHA-256
};

}  // namespace fieldmark::cli
