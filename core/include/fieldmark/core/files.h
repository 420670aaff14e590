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
  shared,  ///< everybody whom the umask allows
  secret   ///< its owner alone (mode 0600), from the first byte; devices and pipes keep their mode
};

/// A file that appears under its name only when it is complete: it is written to a temporary file in the same
/// folder, flushed to the disk and renamed by commit(). Destroyed before commit(), it leaves the old
/// file and no temporary file. A symbolic link is followed; a device or pipe is written directly.
class AtomicFile {
 public:
  /// @throws IoError if `path` is a folder, or no file can be made in its folder
  explicit AtomicFile(const std::filesystem::path& path, Access access = Access::shared);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();
  /// Appends. @throws IoError if the disk is full or the write fails otherwise
  void write(std::span<const std::byte> bytes);
  /// Flushes and renames; the last call. @throws IoError if either fails
  void commit();

 private:
  [[noreturn]] void fail(const char* what, int error) const;
  std::filesystem::path path_;       ///< as the caller named it
  std::filesystem::path target_;     ///< that the rename replaces
  std::filesystem::path temporary_;  ///< empty where target_ is written directly
  std::size_t written_ = 0;
  int fd_ = -1;
};

/// @{
/// Writes a whole file, see AtomicFile. @throws IoError
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file_atomically(const std::filesystem::path& path, std::string_view text);
/// @}

/// @{
/// The contents of a file, to the end. @throws IoError if it is missing, a folder or unreadable
std::vector<std::byte> read_bytes(const std::filesystem::path& path);
std::string read_text(const std::filesystem::path& path);
/// @}

}  // namespace fieldmark
