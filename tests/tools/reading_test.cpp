#include "cli/reading.h"

#include "cli/cli.h"
#include "support/catch.h"
#include "watermark/small_owner.h"

using namespace fieldmark;

TEST_CASE("reading: views to read informed are as given or usual, none without cells", "[reading]") {
  const auto cells = small_owner(), none = small_paper_owner();
  CHECK(cli::informed_views({}, 20, cells) == 20);
  CHECK(cli::informed_views(3, 20, cells) == 3);
  CHECK(cli::informed_views({}, 20, none) == 0);
  CHECK(cli::informed_views(0, 20, none) == 0);
  CHECK_THROWS_WITH(cli::informed_views(3, 20, none),
                    "--informed-count: an owner of preset paper has no cells in space");
}

TEST_CASE("reading: evidence of several images is added cell by cell", "[reading]") {
  CHECK(cli::total_evidence({{"a.png", {1, -2, 0}}, {"b.png", {0.5, 1, 3}}}) ==
        std::vector<double>{1.5, -1, 3});
  CHECK(cli::total_evidence({{"a.png", {4}}}) == std::vector<double>{4});
}

TEST_CASE("reading: what was used is named, and mixed where images differ", "[reading]") {
  using watermark::ReadingKind;
  const cli::ImageEvidence blind{"a.png", {1}}, informed{"b.png", {1}, ReadingKind::informed, 0.99};
  CHECK(cli::reading_used({blind, blind}) == "blind");
  CHECK(cli::reading_used({informed}) == "informed");
  CHECK(cli::reading_used({blind, informed}) == "mixed");
}
