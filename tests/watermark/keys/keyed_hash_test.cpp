#include <fieldmark/core/error.h>
#include <fieldmark/watermark/keys/keyed_hash.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/catch.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
std::uint64_t word_of(const Key& key, std::string_view domain, std::size_t index) {
  std::vector<std::uint64_t> words(index + 1);
  keyed_words(key, domain, words);
  return words.back();
}
}  // namespace

TEST_CASE("keyed_hash: words of another implementation (Python's hashlib.blake2b)") {
  const Key key = test_key(0);
  CHECK(word_of(key, "cells", 0) == 0xb2bb147b042b4835u);
  CHECK(word_of(key, "cells", 1) == 0x78c305776005c168u);
  CHECK(word_of(key, "cells", 7) == 0x2e0dccf0e64f9a63u);
  CHECK(word_of(key, "cells", 8) == 0xdcaf4298fcc68d7au);
  CHECK(word_of(key, "cells", 15) == 0x30e40fa50bb6b93du);
  CHECK(to_hex(derive_key(key, "sub", 3)) ==
        "62095197a2fc149f37b8f45686e2ee2958258f442b3b04eaa1bc916b52ede5c2");
}

TEST_CASE("keyed_hash: a stream of any length is the beginning of a longer one, and signs are its bits") {
  const Key key = test_key(1);
  std::vector<std::uint64_t> all(1100);
  keyed_words(key, "d", all);
  for (std::size_t n : {0u, 1u, 7u, 8u, 9u, 64u, 511u, 512u, 513u, 1100u}) {
    std::vector<std::uint64_t> words(n);
    std::vector<std::int8_t> signs(n);
    keyed_words(key, "d", words);
    keyed_signs(key, "d", signs);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < n; ++i) {
      wrong += words[i] != all[i];
      wrong += signs[i] != ((all[i / 64] >> (i % 64)) & 1 ? 1 : -1);
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("keyed_hash: keys, domains and their lengths give unrelated streams") {
  CHECK(word_of(test_key(0), "a", 0) != word_of(test_key(1), "a", 0));
  CHECK(word_of(test_key(0), "a", 0) != word_of(test_key(0), "b", 0));
  CHECK(word_of(test_key(0), "", 0) != word_of(test_key(0), std::string_view("\0", 1), 0));
  CHECK_FALSE(derive_key(test_key(0), "a", 0) == derive_key(test_key(0), "a", 1));
}

TEST_CASE("keyed_hash: signs are fair and independent") {
  std::vector<std::int8_t> signs(100000);
  keyed_signs(test_key(2), "fair", signs);
  double sum = 0, pairs = 0;
  for (std::size_t i = 0; i < signs.size(); ++i) {
    sum += signs[i];
    pairs += signs[i] * signs[(i + 1) % signs.size()];
  }
  CHECK(std::abs(sum) < 4 * std::sqrt(100000.0));
  CHECK(std::abs(pairs) < 4 * std::sqrt(100000.0));
}

TEST_CASE("keyed_hash: the key of a seed has the seed's bytes, little-endian, and zeros") {
  const Key key = key_of_seed(0x0102030405060708u);
  for (std::size_t k = 0; k < 8; ++k) CHECK(key.bytes[k] == 8 - k);
  for (std::size_t k = 8; k < key.bytes.size(); ++k) CHECK(key.bytes[k] == 0);
}
