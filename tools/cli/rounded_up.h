#pragma once
#include <string>

namespace fieldmark::cli {

/// Writes an upper bound with a few digits, rounded up so that the text is a bound as well: 1.04e-06 becomes
/// "1.1e-06".
/// @param bound  at least 0, finite   @param digits  significant ones, 1 to 15
std::string rounded_up(double bound, int digits = 2);

}  // namespace fieldmark::cli
