#include <fieldmark/watermark/evidence/commitment.h>

#include "support/catch.h"
#include "watermark/test_key.h"

using namespace fieldmark::watermark;

TEST_CASE("commitment: it fixes owner, key and message, and sha256sum repeats it") {
  const std::string owner(64, 'a');
  const Message message = message_from_hex("a5c", 10);
  const std::string committed = commitment(owner, test_key(0), message);
  CHECK(committed == "5a24af77e845d197c77791d5fa87942425772828d45d07ed871fedcd4d4235a0");  // Python's hashlib
  CHECK(committed != commitment(std::string(64, 'b'), test_key(0), message));
  CHECK(committed != commitment(owner, test_key(1), message));
  CHECK(committed != commitment(owner, test_key(0), message_from_hex("a5c", 11)));
  CHECK_THROWS_WITH(commitment("12", test_key(0), message),
                    "[commitment] owner_sha256 must be 64 digits 0-9 or a-f, got '12'");
}
