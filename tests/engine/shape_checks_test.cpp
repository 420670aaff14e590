#include <fieldmark/engine/shape_checks.h>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("error: messages name op, argument, expectation and what came") {
  CHECK_THROWS_WITH(check_extent("op", "x", Shape{2, 3}, 1, 4, "the rows of w"),
                    "[op] x: axis 1 must be 4 (the rows of w), got shape [2, 3]");
  CHECK_THROWS_WITH(check_extent("op", "w", Shape{2, 3}, 0, 4, "the columns of x", Shape{5, 4}),
                    "[op] w: axis 0 must be 4 (the columns of x, whose shape is [5, 4]), got shape [2, 3]");
  CHECK_NOTHROW(check_extent("op", "w", Shape{4, 3}, 0, 4, "the columns of x", Shape{5, 4}));
  CHECK_THROWS_WITH(check_rank("op", "x", Shape{2, 3}, 1, "[n]"),
                    "[op] x must have rank 1 [n], got shape [2, 3]");
  CHECK_THROWS_WITH(check_same("op", "a", Shape{2}, "b", Shape{3}),
                    "[op] b must have the shape of a, [2], got shape [3]");
  CHECK_NOTHROW(check_extent("op", "x", Shape{2, 3}, -1, 3, ""));
}

TEST_CASE("error: kinds can be told apart and share a root") {
  CHECK_THROWS_AS(throw IoError("x"), Error);
  CHECK_THROWS_AS(check_rank("op", "x", Shape{}, 1, "[n]"), ShapeError);
}

TEST_CASE("shape_checks: an axis counts from either end") {
  const Shape s{2, 3};
  CHECK(check_axis("op", "axis", 1, s) == 1);
  CHECK(check_axis("op", "axis", -2, s) == 0);
  CHECK_THROWS_WITH(check_axis("op", "axis", 2, s),
                    "[op] axis must be in [-2, 1], an axis of shape [2, 3], got 2");
  CHECK_THROWS_WITH(check_axis("op", "axis", 0, Shape{}),
                    "[op] axis must be an axis, but shape [] has none, got 0");
}
