#include <fieldmark/core/error.h>
#include <fieldmark/imaging/histogram_chart.h>

#include <cmath>
#include <regex>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
struct Bin {
  int x, y, width, height;
};
std::vector<Bin> bins(const std::string& svg) {
  std::vector<Bin> found;
  const std::regex bin(R"re(class="bin" x="(-?\d+)" y="(-?\d+)" width="(\d+)" height="(\d+)")re");
  for (std::sregex_iterator i(svg.begin(), svg.end(), bin), end; i != end; ++i)
    found.push_back({std::stoi((*i)[1]), std::stoi((*i)[2]), std::stoi((*i)[3]), std::stoi((*i)[4])});
  return found;
}
int mark_of(const std::string& svg) {
  std::smatch found;
  REQUIRE(std::regex_search(svg, found, std::regex(R"re(class="mark" x1="(-?\d+)")re")));
  return std::stoi(found[1]);
}
}  // namespace

TEST_CASE("histogram_chart: a bar for each bin that is not empty, higher by the same for each ten times") {
  const auto svg = histogram_chart({"keys", "T", {1, 0, 10, 100, 998}, -2, 1, 8, "the real one"});
  const auto found = bins(svg);
  REQUIRE(found.size() == 4);
  for (const auto& bin : found) CHECK(bin.y + bin.height == 64 + 220);
  // The axis spans 0.5 to 1000: 220 / log10(2000) pixels per decade.
  const double decade = 220 / std::log10(2000.);
  CHECK(found[0].height == Approx(decade * std::log10(2.)).margin(1));
  CHECK(found[2].height - found[1].height == Approx(decade).margin(1.5));
  CHECK(found[3].height <= 220);
  // 720 pixels for -2 to 9.
  CHECK(found[1].x == Approx(70 + 720 * 2 / 11.).margin(1));
  CHECK(mark_of(svg) == Approx(70 + 720 * 10 / 11.).margin(1));
  CHECK(svg.starts_with("<svg xmlns="));
  CHECK(svg.ends_with("</svg>\n"));
}

TEST_CASE("histogram_chart: a mark far to the left is in the image, and empty bins are none") {
  const auto svg = histogram_chart({"keys", "T", {0, 0, 0}, -1, 0.5, -30, "a"});
  CHECK(bins(svg).empty());
  CHECK(mark_of(svg) > 70);
  CHECK(mark_of(svg) < 120);
}

TEST_CASE("histogram_chart: text cannot break out of the image, and what cannot be drawn is refused") {
  const auto svg = histogram_chart({"</svg>", "<x>", {1}, 0, 1, 0, "\"&"});
  CHECK(svg.find("</svg>") == svg.size() - 7);
  CHECK_THAT(svg, Contains("&lt;x&gt;") && Contains("&quot;&amp;"));
  CHECK_THROWS_WITH(histogram_chart({"t", "x", {}, 0, 1, 0, ""}), Contains("must have bins"));
  CHECK_THROWS_AS(histogram_chart({"t", "x", {1}, 0, 0, 0, ""}), ValueError);
  CHECK_THROWS_AS(histogram_chart({"t", "x", {1}, 0, 1, std::nan(""), ""}), ValueError);
  CHECK_THROWS_WITH(histogram_chart({"t", "x", {-1}, 0, 1, 0, ""}), Contains("at least 0"));
}
