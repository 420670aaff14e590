#include <fieldmark/watermark/evidence/numerics_cases.h>

#include "support/expect_numerics.h"

TEST_CASE(
    "numerics_cases: every hard case of p-values and marks is within its limit on each instruction set") {
  expect_numerics(fieldmark::watermark::numerics_cases());
}
