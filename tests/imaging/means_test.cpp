#include <fieldmark/imaging/means.h>

#include <limits>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("means: infinite and undefined values are left out") {
  const double infinity = std::numeric_limits<double>::infinity(), none = std::nan("");
  CHECK(finite_mean({1, infinity, 2, none, 6}) == 3);
  CHECK(std::isnan(finite_mean({infinity, none})));
  CHECK(std::isnan(finite_mean({})));
}

TEST_CASE("means: the fifth percentile has a twentieth of the values below it") {
  std::vector<double> values(100);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>((37 * i) % 100);
  CHECK(percentile_5(values) == 5);
  CHECK(percentile_5({7}) == 7);
}
