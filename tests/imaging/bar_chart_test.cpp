#include <fieldmark/core/error.h>
#include <fieldmark/imaging/bar_chart.h>

#include <cmath>
#include <regex>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
std::vector<int> lengths(const std::string& svg) {
  std::vector<int> found;
  const std::regex bar("class=\"bar\"[^>]* width=\"(\\d+)\"");
  for (std::sregex_iterator i(svg.begin(), svg.end(), bar), end; i != end; ++i)
    found.push_back(std::stoi((*i)[1]));
  return found;
}
}  // namespace

TEST_CASE("bar_chart: bars are as long as their values, cut at the end of the axis") {
  const auto svg = bar_chart(
      "speed", {{"a", 0.5, "half"}, {"b", 1, ""}, {"c", 3, "cut"}, {"d", 0, ""}, {"e", std::nan(""), ""}}, 1);
  CHECK(lengths(svg) == std::vector<int>{180, 360, 360, 0, 0});
  CHECK(lengths(bar_chart("t", {{"a", 0.5, ""}}, 2)) == std::vector<int>{90});
  CHECK_THAT(svg, Contains(">half</text>"));
  CHECK(svg.starts_with("<svg xmlns="));
  CHECK(svg.ends_with("</svg>\n"));
}

TEST_CASE("bar_chart: text cannot break out of the image") {
  const auto svg = bar_chart("a<b>&\"c\"", {{"</svg>", 1, "x"}}, 1);
  CHECK_THAT(svg, Contains("a&lt;b&gt;&amp;&quot;c&quot;") && Contains("&lt;/svg&gt;"));
  CHECK(svg.find("</svg>") == svg.size() - 7);
  CHECK_THROWS_AS(bar_chart("t", {}, 0), ValueError);
  CHECK_THROWS_WITH(bar_chart("t", {}, -1), "[bar_chart] full must be positive, got -1");
}
