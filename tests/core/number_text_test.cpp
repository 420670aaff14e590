#include <fieldmark/core/number_text.h>

#include <cstdint>
#include <limits>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("number_text: as many digits as a number needs, exponents for very small and large ones") {
  CHECK(number_text(0.1) == "0.1");
  CHECK(number_text(0.1f) == "0.1");
  CHECK(number_text(-1.0) == "-1");
  CHECK(number_text(0.0) == "0");
  CHECK(number_text(1e-4) == "0.0001");
  CHECK(number_text(-1e-9) == "-1e-09");
  CHECK(number_text(123456789012345.0) == "123456789012345");
  CHECK(number_text(1e15) == "1e+15");
  CHECK(number_text(std::numeric_limits<double>::infinity()) == "inf");
  CHECK(number_text(std::numeric_limits<double>::quiet_NaN()) == "nan");
}

TEST_CASE("number_text: whole numbers keep all digits") {
  CHECK(number_text(std::numeric_limits<std::int64_t>::min()) == "-9223372036854775808");
  CHECK(number_text(std::numeric_limits<std::uint64_t>::max()) == "18446744073709551615");
}

TEST_CASE("number_text: check_number names the function, the argument, what was wanted and what came") {
  CHECK_NOTHROW(check_number("f", "x", 1.0, true, "positive"));
  CHECK_THROWS_AS(check_number("f", "x", -1e-9, false, "positive"), ValueError);
  CHECK_THROWS_WITH(check_number("f", "x", -1e-9, false, "positive"), "[f] x must be positive, got -1e-09");
  CHECK_THROWS_WITH(check_number("f", "n", std::int64_t{-3}, false, "at least 0"),
                    "[f] n must be at least 0, got -3");
}
