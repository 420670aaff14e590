#include <fieldmark/distort/gradcheck_cases.h>

#include "support/gradcheck_cases.h"

using namespace fieldmark;

TEST_CASE("distort gradcheck_cases: every case of the module passes") {
  expect_cases_pass(distort::gradcheck_cases());
}

TEST_CASE("distort gradcheck_cases: every header that promises a gradient has a case") {
  CHECK(expect_case_of_each_header(distort::gradcheck_cases(), "distort") == 6);
}
