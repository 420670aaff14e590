#pragma once
#include <string>
#include <string_view>

namespace fieldmark::watermark {

/// Returns the canonical form of a JSON text, for signing and comparing bytes: members sorted by name,
/// integers in decimal and other numbers as C's "%.9e", UTF-8 strings with minimal escapes, two spaces per
/// level, lists of plain values on one line, and a final line feed. Of members with the same name the last
/// counts, so a text that repeats a name is not canonical.
/// @param name  stands for the file in error messages
/// @throws IoError if the text is not JSON, has a number beyond a double's range or more than 32 levels
std::string canonical_json(std::string_view json, std::string_view name);

}  // namespace fieldmark::watermark
