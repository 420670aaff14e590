#include "cli/one_in.h"

#include <cmath>
#include <cstdio>

#include "cli/rounded_up.h"

namespace fieldmark::cli {
namespace {

std::string with_format(const char* format, double value) {
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string one_in_number(std::string digits, NumberStyle style) {
  const char* space = style == NumberStyle::html ? "&nbsp;" : " ";
  for (auto at = std::ssize(digits) - 3; at > 0; at -= 3) digits.insert(static_cast<std::size_t>(at), space);
  return "1 in " + digits;
}

}  // namespace

std::string one_in(double bound, NumberStyle style) {
  const int zeros = static_cast<int>(std::floor(-std::log10(bound) + 1e-9));
  if (zeros < 1) return rounded_up(100 * bound, 3) + "%";
  const std::string power = std::to_string(zeros);
  if (zeros > 9) return style == NumberStyle::html ? "1 in 10<sup>" + power + "</sup>" : "1 in 10^" + power;
  return one_in_number("1" + std::string(static_cast<std::size_t>(zeros), '0'), style);
}

std::string exact_rate(double rate, NumberStyle style) {
  const double n = std::round(1 / rate);
  const bool power_of_ten = std::abs(rate * std::pow(10, std::round(-std::log10(rate))) - 1) < 1e-12;
  if (power_of_ten) return one_in(rate, style);
  if (rate >= 0.01) return with_format("%.6g", 100 * rate) + "%";
  if (n > 1e9 || std::abs(n * rate - 1) > 1e-12) return with_format("%.6g", rate);
  return one_in_number(with_format("%.0f", n), style);
}

}  // namespace fieldmark::cli
