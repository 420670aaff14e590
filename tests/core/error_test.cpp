#include <fieldmark/core/error.h>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("error: every kind is an Error with its text") {
  CHECK_THROWS_AS(throw ShapeError("shape"), Error);
  CHECK_THROWS_AS(throw ValueError("value"), Error);
  CHECK_THROWS_WITH(throw IoError("file: byte 3"), "file: byte 3");
}
