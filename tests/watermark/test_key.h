#pragma once
#include <fieldmark/watermark/keys/key.h>

/// Returns the key of bytes first, first + 1, ... modulo 256.
inline fieldmark::watermark::Key test_key(unsigned first) {
  fieldmark::watermark::Key key;
  for (auto& byte : key.bytes) byte = static_cast<std::uint8_t>(first++);
  return key;
}
