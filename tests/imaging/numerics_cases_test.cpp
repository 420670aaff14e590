#include <fieldmark/imaging/numerics_cases.h>

#include "support/expect_numerics.h"

TEST_CASE("numerics_cases: every hard case of image metrics is within its limit on each instruction set") {
  expect_numerics(fieldmark::imaging::numerics_cases());
}
