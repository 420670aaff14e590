#include <fieldmark/engine/error.h>
#include <fieldmark/watermark/key.h>

#include <algorithm>

#include "sodium_init.h"

namespace fieldmark::watermark {

Key random_key() {
  ensure_sodium();
  Key key;
  randombytes_buf(key.bytes.data(), key.bytes.size());
  return key;
}

Key key_from_bytes(std::span<const std::uint8_t> bytes) {
  Key key;
  if (bytes.size() != key.bytes.size()) {
    throw ValueError("[key_from_bytes] bytes: must have " + std::to_string(key.bytes.size()) +
                     " entries, got " + std::to_string(bytes.size()));
  }
  std::copy(bytes.begin(), bytes.end(), key.bytes.begin());
  return key;
}

std::string to_hex(const Key& key) {
  std::string text(2 * key.bytes.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), key.bytes.data(), key.bytes.size());
  text.pop_back();
  return text;
}

}  // namespace fieldmark::watermark
