#pragma once
#include <fieldmark/watermark/keys/key.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// The key that deals the cells of one recipient's copy.
///   K_r = derive_key(K, "fieldmark copy " || name, 0)
/// Codes of two recipients are independent, and nobody without K can derive one.
/// @param name  of the recipient, byte by byte as it stands   @throws ValueError if it is empty
Key copy_key(const Key& key, std::string_view name);

/// Recipients of a text file, one a line, UTF-8; spaces around a name and empty lines are left out.
/// @throws IoError if the file cannot be read, names nobody, or names one twice
std::vector<std::string> read_recipients(const std::filesystem::path& path);

}  // namespace fieldmark::watermark
