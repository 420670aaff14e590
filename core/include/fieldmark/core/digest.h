#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace fieldmark {

/// SHA-256 of a range of bytes, 64 lower-case hexadecimal digits.
std::string sha256_hex(std::span<const std::byte> bytes);
/// The same for a text.
std::string sha256_hex(std::string_view text);

/// SHA-256 of a file's bytes, read in chunks, 64 lower-case hexadecimal digits.
/// @throws IoError if the file cannot be opened or read
std::string sha256_file_hex(const std::filesystem::path& path);

}  // namespace fieldmark
