#include <fieldmark/core/base64.h>

#include <string_view>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("base64: the standard's examples (RFC 4648, section 10)") {
  const auto of = [](std::string_view text) { return to_base64(std::as_bytes(std::span(text))); };
  CHECK(of("") == "");
  CHECK(of("f") == "Zg==");
  CHECK(of("fo") == "Zm8=");
  CHECK(of("foo") == "Zm9v");
  CHECK(of("foob") == "Zm9vYg==");
  CHECK(of("fooba") == "Zm9vYmE=");
  CHECK(of("foobar") == "Zm9vYmFy");
  CHECK(of("\xff\xfe\xfd") == "//79");
  CHECK(of(std::string(1000, 'a')).size() == 1336);
}
