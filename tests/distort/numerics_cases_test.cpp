#include <fieldmark/distort/numerics_cases.h>

#include "support/expect_numerics.h"

TEST_CASE("numerics_cases: every hard case of distortions is within its limit on each instruction set") {
  expect_numerics(fieldmark::distort::numerics_cases());
}
