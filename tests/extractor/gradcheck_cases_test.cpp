#include <fieldmark/extractor/gradcheck_cases.h>

#include "support/gradcheck_cases.h"

using namespace fieldmark;

TEST_CASE("extractor gradcheck_cases: every case of the module passes") {
  expect_cases_pass(extractor::gradcheck_cases());
}

TEST_CASE("extractor gradcheck_cases: every header that promises a gradient has a case") {
  CHECK(expect_case_of_each_header(extractor::gradcheck_cases(), "extractor") == 4);
}
