#include <fieldmark/core/error.h>
#include <fieldmark/imaging/scatter_chart.h>

#include <cmath>
#include <limits>
#include <regex>

#include "imaging/drawn_points.h"
#include "support/catch.h"
#include "support/count_parts.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
// True if every element closes and no text holds a bare bracket: one pass over the tags with a stack.
bool well_formed(const std::string& svg) {
  std::vector<std::string> open;
  const std::regex tag("<(/?)([a-z]+)((?: [a-zA-Z0-9-]+=\"[^\"<>]*\")*)(/?)>");
  std::string rest = std::regex_replace(svg, tag, "");
  if (rest.find_first_of("<>\"") != std::string::npos) return false;
  for (std::sregex_iterator i(svg.begin(), svg.end(), tag), end; i != end; ++i) {
    if ((*i)[1].length()) {
      if (open.empty() || open.back() != (*i)[2]) return false;
      open.pop_back();
    } else if (!(*i)[4].length()) {
      open.push_back((*i)[2]);
    }
  }
  return open.empty();
}
}  // namespace

TEST_CASE("scatter_chart: equal ratios in x and equal differences in y are equally far apart") {
  const auto at = places(scatter_chart({"t", "x", "y"}, {{1, 10, "a"}, {10, 20, "a"}, {100, 40, "b"}}));
  REQUIRE(at.size() == 3);
  CHECK(std::abs((at[1].x - at[0].x) - (at[2].x - at[1].x)) <= 1);
  CHECK(std::abs(2 * (at[0].y - at[1].y) - (at[1].y - at[2].y)) <= 3);
  CHECK(at[0].y > at[1].y);  // up is more
  CHECK(at[2].x - at[0].x > 500);
}

TEST_CASE("scatter_chart: series, the line from left to right, and the ring") {
  const auto svg = scatter_chart({"t", "x", "y"}, {{4, 3, "first", "c", true, true},
                                                   {1, 1, "second", "a", true},
                                                   {2, 2, "first", "", true},
                                                   {3, 0, "second", "d"}});
  CHECK(well_formed(svg));
  CHECK(count_parts(svg, ">first</text>") == 1);
  CHECK(count_parts(svg, ">second</text>") == 1);
  CHECK(count_parts(svg, "stroke-width=\"2\"") == 1);
  std::smatch line;
  REQUIRE(std::regex_search(svg, line, std::regex("points=\"(\\d+),(\\d+) (\\d+),(\\d+) (\\d+),(\\d+) \"")));
  CHECK(std::stoi(line[1]) < std::stoi(line[3]));
  CHECK(std::stoi(line[3]) < std::stoi(line[5]));
}

TEST_CASE("scatter_chart: points close in x have lines between them, and y ends where it must") {
  const std::vector<ScatterPoint> points{{86, 46, "s"}, {94, 100, "s"}};
  const auto open = scatter_chart({"t", "x", "y"}, points);
  for (const char* tick : {">86<", ">90<", ">94<", ">110<"}) CHECK_THAT(open, Contains(tick));
  const auto closed = scatter_chart({.title = "t", .x = "x", .y = "y", .y_most = 100}, points);
  CHECK_THAT(closed, Contains(">100<") && !Contains(">110<"));
  CHECK(places(closed)[1].y == 84);  // the frame's top
  // No limit makes the chart invalid.
  CHECK_THAT(scatter_chart({.title = "t", .x = "x", .y = "y", .y_most = -5}, points), !Contains("nan"));
}

TEST_CASE("scatter_chart: labels do not lie on each other, and text cannot break out of the image") {
  std::vector<ScatterPoint> points(9, {1, 1, "s", "label"});
  const auto svg = scatter_chart({"a<b>&\"c\"", "</svg>", "y"}, points);
  CHECK(well_formed(svg));
  CHECK_THAT(svg, Contains("a&lt;b&gt;&amp;&quot;c&quot;") && Contains("&lt;/svg&gt;"));
  std::vector<std::pair<int, int>> seen;
  const std::regex label("<text x=\"(\\d+)\" y=\"(\\d+)\"[^>]*>label<");
  for (std::sregex_iterator i(svg.begin(), svg.end(), label), end; i != end; ++i) {
    const std::pair<int, int> place{std::stoi((*i)[1]), std::stoi((*i)[2])};
    CHECK(std::find(seen.begin(), seen.end(), place) == seen.end());
    seen.push_back(place);
  }
  CHECK(seen.size() == 9);
}

TEST_CASE("scatter_chart: what cannot be drawn") {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const auto svg = scatter_chart({"t", "x", "y"}, {{1, inf, "s"}, {1, nan, "s"}, {nan, 1, "s"}, {2, 1, "s"}});
  CHECK(places(svg).size() == 1);
  CHECK(well_formed(svg));
  CHECK_THROWS_WITH(scatter_chart({}, {{1, nan, "s"}}),
                    "[scatter_chart] points must have one that is finite");
  CHECK_THROWS_WITH(scatter_chart({}, {{0, 1, "s"}}), "[scatter_chart] x must be positive, got 0");
}

TEST_CASE("scatter_chart: curves join each series in its own order and name it at its end") {
  const auto svg = scatter_chart({.title = "t", .x = "x", .y = "y", .curves = true},
                                 {{8, 1, "b"}, {1, 0.9, "a"}, {2, 0.8, "b"}, {4, 0.5, "a"}, {3, 0.7, "b"}});
  CHECK(well_formed(svg));
  const auto at = places(svg);
  REQUIRE(at.size() == 5);
  const auto line = [&](std::vector<std::size_t> order) {
    std::string text = "points=\"";
    for (const std::size_t i : order) text += std::to_string(at[i].x) + "," + std::to_string(at[i].y) + " ";
    return text + "\"";
  };
  CHECK(count_parts(svg, "class=\"curve\"") == 2);
  CHECK(count_parts(svg, line({0, 2, 4})) == 1);
  CHECK(count_parts(svg, line({1, 3})) == 1);
  CHECK(count_parts(svg, ">a</text>") == 1);
  CHECK(count_parts(svg, ">b</text>") == 1);
}
