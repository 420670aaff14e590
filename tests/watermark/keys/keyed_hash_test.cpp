#include <fieldmark/core/error.h>
#include <fieldmark/watermark/keys/keyed_hash.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/catch.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("keyed_hash: words of another implementation (Python's hashlib.blake2b)") {
  const Key key = test_key(0);
  CHECK(keyed_u64(key, "cells", 0) == 0xb2bb147b042b4835u);
  CHECK(keyed_u64(key, "cells", 1) == 0x78c305776005c168u);
  CHECK(keyed_u64(key, "cells", 7) == 0x2e0dccf0e64f9a63u);
  CHECK(keyed_u64(key, "cells", 8) == 0xdcaf4298fcc68d7au);
  CHECK(keyed_u64(key, "cells", 15) == 0x30e40fa50bb6b93du);
  CHECK(keyed_u64(key, "", ~std::uint64_t{0}) == 0x312e400b61038bc8u);
  CHECK(to_hex(derive_key(key, "sub", 3)) ==
        "62095197a2fc149f37b8f45686e2ee2958258f442b3b04eaa1bc916b52ede5c2");
}

TEST_CASE("keyed_hash: streams equal the single words and signs for every length") {
  const Key key = test_key(1);
  for (std::size_t n : {0u, 1u, 7u, 8u, 9u, 64u, 511u, 512u, 513u, 1100u}) {
    std::vector<std::uint64_t> words(n);
    std::vector<std::int8_t> signs(n);
    keyed_words(key, "d", words);
    keyed_signs(key, "d", signs);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < n; ++i) {
      wrong += words[i] != keyed_u64(key, "d", i);
      wrong += signs[i] != keyed_sign(key, "d", i);
      wrong += signs[i] != 1 && signs[i] != -1;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("keyed_hash: keys, domains and their lengths give unrelated streams") {
  CHECK(keyed_u64(test_key(0), "a", 0) != keyed_u64(test_key(1), "a", 0));
  CHECK(keyed_u64(test_key(0), "a", 0) != keyed_u64(test_key(0), "b", 0));
  CHECK(keyed_u64(test_key(0), "", 0) != keyed_u64(test_key(0), std::string_view("\0", 1), 0));
  CHECK_FALSE(derive_key(test_key(0), "a", 0) == derive_key(test_key(0), "a", 1));
}

TEST_CASE("keyed_hash: signs are fair and independent, orders are uniform permutations") {
  std::vector<std::int8_t> signs(100000);
  keyed_signs(test_key(2), "fair", signs);
  double sum = 0, pairs = 0;
  for (std::size_t i = 0; i < signs.size(); ++i) {
    sum += signs[i];
    pairs += signs[i] * signs[(i + 1) % signs.size()];
  }
  CHECK(std::abs(sum) < 4 * std::sqrt(100000.0));
  CHECK(std::abs(pairs) < 4 * std::sqrt(100000.0));

  std::array<int, 5> first{};
  const std::vector<Index> identity{0, 1, 2, 3, 4};
  for (unsigned k = 0; k < 2000; ++k) {
    const auto order = keyed_order(derive_key(test_key(3), "order", k), "o", 5);
    REQUIRE(std::is_permutation(order.begin(), order.end(), identity.begin(), identity.end()));
    ++first[static_cast<std::size_t>(order[0])];
  }
  for (int count : first) CHECK(std::abs(count - 400) < 4 * 18);  // sqrt(2000 * 0.2 * 0.8) = 17.9
}

TEST_CASE("keyed_hash: an order sorts by word, none of nothing, no negative n") {
  const Key key = test_key(4);
  const auto order = keyed_order(key, "o", 100);
  const auto word = [&](Index i) { return keyed_u64(key, "o", static_cast<std::uint64_t>(i)); };
  CHECK(std::is_sorted(order.begin(), order.end(), [&](Index a, Index b) { return word(a) < word(b); }));
  CHECK(keyed_order(key, "o", 0).empty());
  CHECK_THROWS_WITH(keyed_order(key, "o", -1), "[keyed_order] n must be at least 0, got -1");
}
