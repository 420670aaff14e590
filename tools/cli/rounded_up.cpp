#include "cli/rounded_up.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace fieldmark::cli {

std::string rounded_up(double bound, int digits) {
  const auto text_of = [digits](double x) {
    char text[40];
    std::snprintf(text, sizeof text, "%.*g", digits, x);
    return std::string(text);
  };
  const std::string nearest = text_of(bound);
  if (!(std::strtod(nearest.c_str(), nullptr) < bound)) return nearest;
  return text_of(bound + 0.5 * std::pow(10.0, std::floor(std::log10(bound)) - digits + 1));
}

}  // namespace fieldmark::cli
