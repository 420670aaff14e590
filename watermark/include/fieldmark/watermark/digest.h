#pragma once
#include <fieldmark/watermark/key.h>
#include <fieldmark/watermark/message.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace fieldmark::watermark {

/// SHA-256 of a range of bytes, 64 lower-case hexadecimal digits.
std::string sha256_hex(std::span<const std::byte> bytes);
/// The same of the bytes of a text.
std::string sha256_hex(std::string_view text);

/// SHA-256 of a file's bytes, read in pieces, 64 lower-case hexadecimal digits.
/// @throws IoError if the file cannot be opened or read
std::string sha256_file_hex(const std::filesystem::path& path);

/// What an owner publishes, or has time-stamped, before the field: it fixes OWNER, key and message without
/// giving them away. SHA-256 of this text, each line ended by a line feed, so that `sha256sum` repeats it:
///   fieldmark claim 1
///   owner SHA-256-OF-THE-OWNER-FILE
///   key 64-DIGITS
///   message NUMBER-OF-BITS HEXADECIMAL-DIGITS
/// @param owner_sha256  sha256_file_hex of the OWNER file   @throws ValueError if it is not 64 hexadecimal
/// digits
std::string claim_digest(std::string_view owner_sha256, const Key& key, const Message& message);

}  // namespace fieldmark::watermark
