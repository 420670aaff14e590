#include <fieldmark/nerf/gradcheck_cases.h>

#include "support/gradcheck_cases.h"

using namespace fieldmark;

TEST_CASE("nerf gradcheck_cases: every case of the module passes") {
  expect_cases_pass(nerf::gradcheck_cases());
}

TEST_CASE("nerf gradcheck_cases: every header that promises a gradient has a case") {
  CHECK(expect_case_of_each_header(nerf::gradcheck_cases(), "nerf") == 10);
}
