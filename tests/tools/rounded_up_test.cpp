#include "cli/rounded_up.h"

#include <cmath>
#include <cstdlib>

#include "support/catch.h"
#include "support/random.h"

using fieldmark::cli::rounded_up;

TEST_CASE("rounded_up: a bound stays a bound, in its digits") {
  CHECK(rounded_up(1.04e-6) == "1.1e-06");
  CHECK(rounded_up(1.0e-6) == "1e-06");
  CHECK(rounded_up(9.91e-6) == "1e-05");
  CHECK(rounded_up(0.996) == "1");
  CHECK(rounded_up(0.5) == "0.5");
  CHECK(rounded_up(0) == "0");
  CHECK(rounded_up(1.0004e-20, 4) == "1.001e-20");
  CHECK(rounded_up(2.3e-308) == "2.3e-308");
}

TEST_CASE("rounded_up: the text is never below the bound, and at most one unit above it") {
  const auto exponents = uniform<double>({2000}, -300, 0, 1), digits = uniform<double>({2000}, 1, 10, 2);
  for (fieldmark::Index i = 0; i < exponents.size(); ++i) {
    const double x = digits[i] * std::pow(10.0, std::floor(exponents[i]));
    const double text = std::strtod(rounded_up(x).c_str(), nullptr);
    CAPTURE(x, text);
    CHECK(text >= x);
    CHECK(text <= x * 1.1000001);
  }
}
