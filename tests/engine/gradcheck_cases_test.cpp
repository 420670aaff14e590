#include <fieldmark/engine/gradcheck_cases.h>

#include "support/gradcheck_cases.h"

using namespace fieldmark;

TEST_CASE("gradcheck_cases: every case of the engine passes, to 1e-7") {
  expect_cases_pass(gradcheck_cases(), 1e-7);
}

TEST_CASE("engine gradcheck_cases: every header that promises a gradient has a case") {
  CHECK(expect_case_of_each_header(gradcheck_cases(), "engine") == 35);
}
