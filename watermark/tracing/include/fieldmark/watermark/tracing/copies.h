#pragma once
#include <fieldmark/watermark/keys/key.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// Derives the key that deals the cells of one recipient's copy.
///   K_r = derive_key(K, "fieldmark copy " || name, 0)
/// The codes of two recipients are independent, and nobody can derive one without K.
/// @param name  of the recipient, used byte for byte   @throws ValueError if it is empty
Key copy_key(const Key& key, std::string_view name);

/// Checks that a list can hold this name of a recipient.
/// @throws ValueError if it is empty, begins or ends with a space, or has a control character
void check_recipient(std::string_view name);

/// Reads recipients from a UTF-8 text file, one per line, without surrounding spaces, empty lines and a
/// byte-order mark.
/// @throws IoError if the file cannot be read, names nobody, names one twice, or check_recipient() refuses
/// one
std::vector<std::string> read_recipients(const std::filesystem::path& path);

}  // namespace fieldmark::watermark
