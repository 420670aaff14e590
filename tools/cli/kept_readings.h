#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "cli/reading.h"

namespace fieldmark::cli {

/// Readings of images, stored in a file so that a stopped command need not repeat them. The file has one line
/// of JSON with owner, detection and instruction set, then one per image with the SHA-256 of its bytes. A
/// truncated last line is dropped.
class KeptReadings {
 public:
  /// Reads the file, or starts it with the owner's number of cells. Never writes to a file of another kind.
  /// @throws IoError     if it cannot be read or written, or is not such a file
  /// @throws UsageError  if it belongs to another owner, detection or instruction set
  KeptReadings(const std::filesystem::path& file, const std::string& owner_sha256,
               const std::string& detection, Index cells);

  /// Returns the reading of an image with this SHA-256, without its name and file; nullopt if there is none.
  std::optional<ImageEvidence> find(const std::string& sha256) const;
  /// Appends a reading to the file. @throws IoError
  void add(const ImageEvidence& read);
  /// Returns the number of images in the file.
  std::size_t size() const { return readings_.size(); }

 private:
  void append(const std::string& line) const;
  std::filesystem::path file_;
  std::map<std::string, ImageEvidence> readings_;  // by SHA-256
};

}  // namespace fieldmark::cli
