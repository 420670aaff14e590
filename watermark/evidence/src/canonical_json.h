#pragma once
#include <string>
#include <string_view>

namespace fieldmark::watermark {

/// The one text of what a JSON text says, so that it can be signed and compared byte by byte: members sorted
/// by the bytes of their names, whole numbers in decimal and all others as C's "%.9e", strings in UTF-8 with
/// only quotes, backslashes and control characters escaped, two spaces for each level, lists of plain values
/// on one line, and a line feed at the end.
/// Of members of one name the last counts, so a text that repeats a name is not canonical.
/// @param name  stands for the file in error texts
/// @throws IoError if it is no JSON, holds a number that no double holds, or more than 32 levels
std::string canonical_json(std::string_view json, std::string_view name);

}  // namespace fieldmark::watermark
