#include <fieldmark/engine/numerics_cases.h>

#include "support/expect_numerics.h"

TEST_CASE("numerics_cases: every hard case of the engine is within its limit on each instruction set") {
  expect_numerics(fieldmark::numerics_cases());
}
