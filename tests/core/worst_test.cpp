#include <fieldmark/core/worst.h>

#include <limits>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("worst: raised by larger errors only") {
  double worst = 0;
  for (const double error : {0.5, 0.25, 0.0, -3.0}) raise_to(worst, error);
  CHECK(worst == 0.5);
  raise_to(worst, std::numeric_limits<double>::infinity());
  CHECK(std::isinf(worst));
}

TEST_CASE("worst: a NaN is the worst, before and after any other error") {
  for (const double other : {0.0, 1.0, std::numeric_limits<double>::infinity()}) {
    double first = std::nan(""), last = other;
    raise_to(first, other);
    raise_to(last, std::nan(""));
    CHECK((std::isnan(first) && std::isnan(last)));
    CHECK_FALSE((first <= 1e9 || last <= 1e9));
  }
}
