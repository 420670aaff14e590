#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::cli {

/// Returns the least number of insertions, deletions and replacements that turn one word into the other.
/// Source: Wagner and Fischer 1974 (Levenshtein distance).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// Returns the known word with the least distance, or "" if more than a third of its letters differ.
std::string nearest_word(std::string_view typed, const std::vector<std::string>& known);

}  // namespace fieldmark::cli
