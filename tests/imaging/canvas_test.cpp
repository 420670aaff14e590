#include <fieldmark/core/error.h>
#include <fieldmark/imaging/canvas.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "support/catch.h"

using namespace fieldmark;

namespace {
constexpr Canvas::Ink kBlack{0, 0, 0};

// Returns the covered area in pixels, fractions included.
double covered_area(const Canvas& canvas) {
  double sum = 0;
  for (const float v : canvas.image().data) sum += 1 - static_cast<double>(v);
  return sum / 3;
}
}  // namespace

TEST_CASE("canvas: a disc and a line have their areas, and lie where they were drawn") {
  Canvas disc(40, 60);
  CHECK(covered_area(disc) == 0);
  CHECK(disc.image().shape == Shape{40, 60, 3});
  disc.line({30, 20}, {30, 20}, 20, kBlack);
  CHECK(covered_area(disc) == Approx(std::numbers::pi * 100).epsilon(0.01));
  CHECK(disc.image()[3 * (20 * 60 + 30)] == 0);
  CHECK(disc.image()[3 * (20 * 60 + 41)] == 1);
  Canvas slanted(40, 60);
  slanted.line({10, 10}, {40, 30}, 3, kBlack);
  CHECK(covered_area(slanted) == Approx(3 * std::hypot(30, 20) + std::numbers::pi * 1.5 * 1.5).epsilon(0.01));
  // Along the middle of a row: one pixel thick, with nothing on the neighbouring rows.
  Canvas row(5, 9);
  row.line({2.5, 2.5}, {6.5, 2.5}, 1, {0.25f, 0.5f, 0.75f});
  for (Index k = 0; k < 3; ++k)
    CHECK(row.image()[3 * (2 * 9 + 4) + k] == Approx(0.25 * (1 + static_cast<double>(k))));
  CHECK(row.image()[3 * (1 * 9 + 4)] == 1);
}

TEST_CASE("canvas: shapes outside it and without a place leave it white") {
  Canvas canvas(8, 8);
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  canvas.line({-50, 4}, {-20, 4}, 2, kBlack);
  canvas.line({nan, 4}, {3, 4}, 2, kBlack);
  canvas.line({1, 4}, {inf, 4}, 2, kBlack);
  canvas.line({1, 4}, {3, 4}, nan, kBlack);
  canvas.text({100, -200}, "far", 2, kBlack);
  CHECK(covered_area(canvas) == 0);
  canvas.line({-1e9, 4.5}, {1e9, 4.5}, 1, kBlack);
  CHECK(covered_area(canvas) == Approx(8));
}

TEST_CASE("canvas: text has its width, grows with its scale and survives any byte") {
  Canvas one(20, 200), two(40, 400);
  one.text({3, 2}, "fern_2", 1, kBlack);
  two.text({6, 4}, "fern_2", 2, kBlack);
  CHECK(covered_area(one) > 40);
  CHECK(covered_area(two) == 4 * covered_area(one));
  for (Index y = 0; y < 40; ++y)
    for (Index x = 0; x < 400; ++x)
      REQUIRE(two.image()[3 * (y * 400 + x)] == one.image()[3 * (y / 2 * 200 + x / 2)]);
  const Index width = Canvas::text_width("fern_2", 1);
  CHECK(Canvas::text_width("fern_2", 2) == 2 * width);
  for (Index y = 0; y < 20; ++y)
    for (Index x : {Index{0}, Index{2}, 3 + width, 4 + width}) CHECK(one.image()[3 * (y * 200 + x)] == 1);
  CHECK(Canvas::text_width("", 1) == 0);
  std::string all;
  for (int c = 0; c < 256; ++c) all += static_cast<char>(c);
  Canvas any(20, 3000), marks(20, 3000);
  any.text({0, 0}, all, 1, kBlack);
  CHECK(covered_area(any) > 1000);
  any = Canvas(20, 3000);
  any.text({0, 0}, "\xff\n", 1, kBlack), marks.text({0, 0}, "??", 1, kBlack);
  CHECK(any.image().data == marks.image().data);
}

TEST_CASE("canvas: a side out of range is refused") {
  CHECK_THROWS_WITH(Canvas(0, 5), "[canvas] height must be 1 to 16384 pixels, got 0");
  CHECK_THROWS_WITH(Canvas(5, 16385), "[canvas] width must be 1 to 16384 pixels, got 16385");
}
