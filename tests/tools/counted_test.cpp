#include "cli/counted.h"

#include "support/catch.h"

using fieldmark::cli::counted;

TEST_CASE("counted: one thing has no s") {
  CHECK(counted(0, "image") == "0 images");
  CHECK(counted(1, "image") == "1 image");
  CHECK(counted(12, "view") == "12 views");
}
