#include "cli/reading.h"

#include "cli/cli.h"
#include "support/catch.h"

using namespace fieldmark;

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
