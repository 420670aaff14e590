#include <fieldmark/imaging/flood_fill.h>

#include <string_view>

#include "support/catch.h"

using namespace fieldmark;

namespace {
// Fills an image given in rows from the pixels `#`; returns the filled pixels in ascending order.
std::vector<Index> filled(std::string_view image, Index width, std::vector<Index> starts,
                          Neighbours neighbours = Neighbours::four) {
  auto found = flood_fill(
      std::ssize(image) / width, width, starts, [&](Index p) { return image[at(p)] == '#'; }, neighbours);
  std::sort(found.begin(), found.end());
  return found;
}
}  // namespace

TEST_CASE("flood_fill: by edges or by corners, each pixel once") {
  constexpr std::string_view kRows =
      "##.."
      ".#.."
      "..##";
  CHECK(filled(kRows, 4, {0}) == std::vector<Index>{0, 1, 5});
  CHECK(filled(kRows, 4, {0}, Neighbours::eight) == std::vector<Index>{0, 1, 5, 10, 11});
  CHECK(filled(kRows, 4, {0, 1, 11, 11}) == std::vector<Index>{0, 1, 5, 10, 11});
}

TEST_CASE("flood_fill: rows do not run into one another, and a start that is not accepted leads nowhere") {
  CHECK(filled("..#"
               "#..",
               3, {2}) == std::vector<Index>{2});
  CHECK(filled("..#"
               "#..",
               3, {2}, Neighbours::eight) == std::vector<Index>{2});
  CHECK(filled("#.#", 3, {1}).empty());
  CHECK(filled("#", 1, {}).empty());
}
