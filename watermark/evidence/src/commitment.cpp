#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>
#include <fieldmark/watermark/evidence/commitment.h>

#include <algorithm>

namespace fieldmark::watermark {

std::string commitment(std::string_view owner_sha256, const Key& key, const Message& message) {
  const bool digits = std::all_of(owner_sha256.begin(), owner_sha256.end(),
                                  [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
  if (owner_sha256.size() != 64 || !digits) {
    throw ValueError("[commitment] owner_sha256 must be 64 digits 0-9 or a-f, got '" +
                     std::string(owner_sha256) + "'");
  }
  return sha256_hex("fieldmark claim 1\nowner " + std::string(owner_sha256) + "\nkey " + to_hex(key) +
                    "\nmessage " + std::to_string(message.size()) + " " + to_hex(message) + "\n");
}

}  // namespace fieldmark::watermark
