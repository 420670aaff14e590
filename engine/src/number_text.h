#pragma once
// Numbers in the texts of errors. Private.
#include <charconv>
#include <cmath>
#include <string>

namespace fieldmark::detail {

/// Returns a number as people write it, with as many digits as it needs: "-1", "0.1", "1e-09".
template <class T>
std::string number_text(T value) {
  const T size = std::abs(value);
  const bool plain = size == 0 || (size >= T(1e-4) && size < T(1e15));
  char text[64];
  const auto format = plain ? std::chars_format::fixed : std::chars_format::general;
  return {text, std::to_chars(text, text + sizeof text, value, format).ptr};
}

}  // namespace fieldmark::detail
