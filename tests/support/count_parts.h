#pragma once
#include <cstddef>
#include <string>

/// Returns how often a part occurs in a text, without overlaps.
inline std::size_t count_parts(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++n;
  return n;
}
