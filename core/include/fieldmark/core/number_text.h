#pragma once
#include <fieldmark/core/error.h>

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <type_traits>

namespace fieldmark {

/// Returns a number as people write it, with as many digits as it needs: "-1", "0.1", "1e-09".
template <class T>
std::string number_text(T value) {
  char text[64];
  if constexpr (std::is_integral_v<T>) {
    return {text, std::to_chars(text, text + sizeof text, value).ptr};
  } else {
    const T size = std::abs(value);
    const bool plain = size == 0 || (size >= T(1e-4) && size < T(1e15));
    const auto format = plain ? std::chars_format::fixed : std::chars_format::general;
    return {text, std::to_chars(text, text + sizeof text, value, format).ptr};
  }
}

/// Checks a number that a function was given. Allocates nothing if it is right.
/// @throws ValueError with "[function] name must be want, got value" unless ok
template <class T>
void check_number(std::string_view function, std::string_view name, T value, bool ok, std::string_view want) {
  if (ok) return;
  throw ValueError("[" + std::string(function) + "] " + std::string(name) + " must be " + std::string(want) +
                   ", got " + number_text(value));
}

}  // namespace fieldmark
