#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark {

/// Who may read a new file.
enum class Access {
  shared,  ///< everyone whom the umask allows
  secret   ///< the owner alone (mode 0600), from the first byte; devices and pipes keep their mode
};

/// A file that appears under its name only when it is complete. The bytes go to a temporary file in the same
/// folder, which commit() flushes to disk and renames. Destruction before commit() keeps the old file and
/// removes the temporary one. Symbolic links are followed; devices and pipes are written directly.
class AtomicFile {
 public:
  /// @throws IoError if `path` is a folder, or no file can be created in its folder
  explicit AtomicFile(const std::filesystem::path& path, Access access = Access::shared);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();
  /// Appends bytes. @throws IoError if the disk is full or the write fails otherwise
  void write(std::span<const std::byte> bytes);
  /// Flushes and renames the file; must be the last call. @throws IoError if either fails
  void commit();

 private:
  [[noreturn]] void fail(const char* what, int error) const;
  std::filesystem::path path_;       ///< as given by the caller
  std::filesystem::path target_;     ///< the file that the rename replaces
  std::filesystem::path temporary_;  ///< empty if target_ is written directly
  std::size_t written_ = 0;
  int fd_ = -1;
};

/// @{
/// Writes a whole file atomically, see AtomicFile. @throws IoError
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);
/// @}

/// @{
/// Reads a file to its end. @throws IoError if it is missing, a folder or unreadable
std::vector<std::byte> read_bytes(const std::filesystem::path& path);
std::string read_text(const std::filesystem::path& path);
/// @}

}  // namespace fieldmark
