#include "cli/one_in.h"

#include <limits>

#include "support/catch.h"

using namespace fieldmark::cli;

TEST_CASE("one_in: a bound stays a bound, in powers of ten or per cent") {
  CHECK(one_in(1) == "100%");
  CHECK(one_in(0.54) == "54%");
  CHECK(one_in(0.1) == "1 in 10");
  CHECK(one_in(0.09) == "1 in 10");
  CHECK(one_in(0.001) == "1 in 1 000");
  CHECK(one_in(7e-7) == "1 in 1 000 000");
  CHECK(one_in(1e-6) == "1 in 1 000 000");
  CHECK(one_in(1.01e-6) == "1 in 100 000");
  CHECK(one_in(1e-9) == "1 in 1 000 000 000");
  CHECK(one_in(6.3e-30) == "1 in 10^29");
  CHECK(one_in(std::numeric_limits<double>::min()) == "1 in 10^307");
}

TEST_CASE("one_in: a required rate is not rounded") {
  CHECK(exact_rate(1) == "100%");
  CHECK(exact_rate(0.25) == "25%");
  CHECK(exact_rate(1e-6) == "1 in 1 000 000");
  CHECK(exact_rate(2e-5) == "1 in 50 000");
  CHECK(exact_rate(2.3e-5) == "2.3e-05");
  CHECK(exact_rate(1e-12) == "1 in 10^12");
}

TEST_CASE("one_in: HTML keeps the digits of a number on one line") {
  CHECK(one_in(1e-4, NumberStyle::html) == "1 in 10&nbsp;000");
  CHECK(one_in(1e-12, NumberStyle::html) == "1 in 10<sup>12</sup>");
  CHECK(one_in(0.5, NumberStyle::html) == "50%");
  CHECK(exact_rate(2e-5, NumberStyle::html) == "1 in 50&nbsp;000");
}
