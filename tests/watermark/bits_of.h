#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

/// Returns the n lowest bits of a value, most significant bit first.
inline std::vector<std::uint8_t> bits_of(std::uint64_t value, std::ptrdiff_t n) {
  std::vector<std::uint8_t> bits;
  for (std::ptrdiff_t i = n - 1; i >= 0; --i) bits.push_back(static_cast<std::uint8_t>((value >> i) & 1));
  return bits;
}
