#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace fieldmark::watermark {

/// The owner's 256-bit secret. Without it, nobody can tell which sign a cell should show.
struct Key {
  std::array<std::uint8_t, 32> bytes{};  ///< never logged or reported
  /// Not constant-time.
  friend bool operator==(const Key&, const Key&) = default;
};

/// Draws 256 bits from the operating system; never from a seed.
/// @throws Error if libsodium cannot start
Key random_key();

/// Makes a key from known bytes, for tests and for keys kept elsewhere.
/// @param bytes  [32]   @throws ValueError for another size
Key key_from_bytes(std::span<const std::uint8_t> bytes);

/// Returns 64 lower-case hexadecimal digits.
std::string to_hex(const Key& key);

/// Writes a KEY file: safetensors with an array "key" of 32 bytes and the kind "key" (see ModelInfo), secret
/// from the first byte (Access::secret).   @throws IoError if writing fails
void save_key(const std::filesystem::path& path, const Key& key);

/// Reads a KEY file.
/// @throws IoError if the file cannot be read, is of another kind, or its array is not 32 bytes
Key load_key(const std::filesystem::path& path);

}  // namespace fieldmark::watermark
