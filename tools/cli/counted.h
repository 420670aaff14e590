#pragma once
#include <cstdint>
#include <string>

namespace fieldmark::cli {

/// Returns a count with its noun, which takes an "s" unless the count is 1: "1 view", "12 views".
/// @param thing  a noun in the singular
std::string counted(std::int64_t count, const std::string& thing);

}  // namespace fieldmark::cli
