#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace fieldmark {

/// Returns the SHA-256 of a range of bytes as 64 lower-case hexadecimal digits.
std::string sha256_hex(std::span<const std::byte> bytes);
/// Overload for text.
std::string sha256_hex(std::string_view text);

/// Returns the SHA-256 of a file as 64 lower-case hexadecimal digits. Reads the file in chunks.
/// @throws IoError if the file cannot be opened or read
std::string sha256_file_hex(const std::filesystem::path& path);

}  // namespace fieldmark
