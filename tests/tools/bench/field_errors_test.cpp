#include "field_errors.h"

#include "support/catch.h"

using namespace fieldmark::bench;

TEST_CASE("field_errors: sums and the worst of known differences") {
  FieldErrors errors;
  CHECK(std::isinf(errors.psnr()));
  for (const double difference : {0.1, -0.3, 0.0}) errors.add(difference);
  for (const double opacity : {0.25, -0.5}) errors.drop(opacity);
  CHECK(errors.worst == 0.3);
  CHECK(errors.psnr() == Approx(-10 * std::log10(0.1 / 3)));
  CHECK((errors.dropped == 0.25 && errors.dropped_most == 0.25 && errors.pixels == 2));
}

TEST_CASE("field_errors: a NaN is the worst of all, and no PSNR is infinite for it") {
  FieldErrors errors;
  errors.add(0.5);
  errors.add(std::nan(""));
  errors.add(0.25);
  errors.drop(std::nan(""));
  errors.drop(1);
  CHECK((std::isnan(errors.worst) && std::isnan(errors.psnr())));
  CHECK((std::isnan(errors.dropped) && std::isnan(errors.dropped_most)));
}
