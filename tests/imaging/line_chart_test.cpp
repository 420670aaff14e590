#include <fieldmark/core/error.h>
#include <fieldmark/imaging/line_chart.h>

#include <cmath>
#include <limits>

#include "imaging/drawn_points.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("line_chart: both axes are linear, and lines go from left to right") {
  const auto svg = line_chart({"t", "x", "y"}, {{"a", {{8, 75}, {0, 50}, {4, 100}}}}, 50, 100);
  const auto at = places(svg);
  REQUIRE(at.size() == 3);
  CHECK(at[0].x < at[1].x);
  CHECK(std::abs((at[1].x - at[0].x) - (at[2].x - at[1].x)) <= 1);
  CHECK(at[0].y - at[1].y == 320);  // the whole height
  CHECK(2 * (at[2].y - at[1].y) == 320);
  CHECK_THAT(svg, Contains(">100</text>") && Contains(">50</text>") && Contains(">a</text>"));
}

TEST_CASE("line_chart: dashes, texts that cannot break out, and points that cannot be drawn") {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const auto svg = line_chart(
      {"a<b>", "x", "y"},
      {{"of others", {{1, 60}}, true}, {"</svg>", {{nan, 1}, {1, inf}, {2, 30}}}, {"empty", {{1, nan}}}}, 50,
      100);
  CHECK_THAT(svg, Contains("stroke-dasharray") && Contains("a&lt;b&gt;") && Contains(">&lt;/svg&gt;<"));
  CHECK_THAT(svg, !Contains(">empty<"));
  const auto at = places(svg);
  REQUIRE(at.size() == 2);
  CHECK(at[1].y - at[0].y == 64);  // 30 is drawn at 50: 60 is a fifth of the height above it
}

TEST_CASE("line_chart: few places have their numbers, many share round ones, and names have room") {
  LineSeries line{"a", {}};
  for (int i = 0; i < 16; ++i) line.points.push_back({1.25 + i, 60});
  CHECK_THAT(line_chart({}, {line}, 50, 100), Contains(">1.25</text>") && Contains(">16.25</text>"));
  line.points.push_back({47, 60});
  const auto many = line_chart({}, {line}, 50, 100);
  for (const char* number : {">5</text>", ">20</text>", ">45</text>"}) CHECK_THAT(many, Contains(number));
  CHECK_THAT(many, !Contains(">1.25</text>") && !Contains(">0</text>"));
  const auto width = [](const std::string& svg) { return std::stoi(svg.substr(svg.find("width=\"") + 7)); };
  line.name = "forty letters, as many as there are here";
  CHECK(width(line_chart({}, {line}, 50, 100)) == width(many) + 39 * 8);
}

TEST_CASE("line_chart: errors") {
  CHECK_THROWS_WITH(line_chart({}, {{"a", {{1, std::nan("")}}}}, 0, 1),
                    "[line_chart] lines must have a point that is finite");
  CHECK_THROWS_WITH(line_chart({}, {}, 1, 1), "[line_chart] y_low must be below y_high, got 1 and 1");
}
