#include <fieldmark/engine/shape.h>

#include <type_traits>
#include <vector>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("shape: extents, rank and size, negative axes count from the last") {
  const Shape s{2, 3, 5};
  CHECK(s.rank() == 3);
  CHECK(s.size() == 30);
  CHECK(s[0] == 2);
  CHECK(s[-1] == 5);
  CHECK(s[-3] == 2);
  CHECK(s.str() == "[2, 3, 5]");
}

TEST_CASE("shape: a scalar has rank 0 and one element, an extent of 0 none") {
  CHECK(Shape{}.rank() == 0);
  CHECK(Shape{}.size() == 1);
  CHECK(Shape{}.str() == "[]");
  CHECK(Shape{4, 0, 7}.size() == 0);
  CHECK(Shape{1 << 20, 1 << 20}.size() == Index{1} << 40);
}

TEST_CASE("shape: more axes than it holds are an error") {
  CHECK(Shape{1, 2, 3, 4, 5}.rank() == 5);
  CHECK_THROWS_WITH((Shape{1, 2, 3, 4, 5, 6}), "[shape] a shape has at most 5 axes, got 6");
  const std::vector<Index> many(9, 1);
  CHECK_THROWS_AS(Shape(std::span<const Index>(many)), ShapeError);
}

TEST_CASE("shape: negative extents and more elements than can be counted are errors") {
  CHECK_THROWS_WITH((Shape{-2, -3}),
                    "[shape] extents must be 0 or more, and their product below 2^63, got [-2, -3]");
  CHECK_THROWS_AS((Shape{0, -1}), ShapeError);
  const Index large = Index{1} << 32;
  CHECK(Shape{large, large / 4}.size() == Index{1} << 62);
  CHECK_THROWS_WITH((Shape{large, large / 2}), Contains("got [4294967296, 2147483648]"));
  for (const Shape& s : {Shape{0, large}, Shape{large, 0}}) CHECK(s.size() == 0);
  CHECK_THROWS_AS((Shape{0, large, large}), ShapeError);
  CHECK_THROWS_AS((Shape{large, large, 0}), ShapeError);
}

TEST_CASE("shape: equal only in rank and every extent") {
  CHECK(Shape{2, 3} == Shape{2, 3});
  CHECK_FALSE(Shape{2, 3} == Shape{3, 2});
  CHECK_FALSE(Shape{2, 3} == Shape{2, 3, 1});
  CHECK_FALSE(Shape{} == Shape{1});
  STATIC_REQUIRE(std::is_trivially_copyable_v<Shape>);
}
