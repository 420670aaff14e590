#pragma once
#include <string>

namespace fieldmark::cli {

/// How numbers are written: for a terminal, or for HTML, where digits stay on one line.
enum class NumberStyle { plain, html };

/// Writes a bound on a probability in words, rounded up to a power of ten: "1 in 1 000 000" for 7e-07. Above
/// 1 in 10 it is a percentage, and from ten zeros on a power: "1 in 10^12".
/// @param bound  above 0, at most 1
std::string one_in(double bound, NumberStyle style = NumberStyle::plain);

/// Writes a required rate, which must not be rounded: "1 in 50 000", "25%" or "2.3e-05".
/// @param rate  above 0, at most 1
std::string exact_rate(double rate, NumberStyle style = NumberStyle::plain);

}  // namespace fieldmark::cli
