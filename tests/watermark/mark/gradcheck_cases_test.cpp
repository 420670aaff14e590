#include <fieldmark/watermark/mark/gradcheck_cases.h>

#include "support/gradcheck_cases.h"

using namespace fieldmark;

TEST_CASE("gradcheck_cases: every case of the module passes") {
  expect_cases_pass(watermark::gradcheck_cases());
}

TEST_CASE("gradcheck_cases: every header that promises a gradient has a case") {
  CHECK(expect_case_of_each_header(watermark::gradcheck_cases(), "watermark/mark") == 4);
}
