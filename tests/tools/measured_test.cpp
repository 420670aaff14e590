#include "cli/measured.h"

#include <cmath>
#include <sstream>

#include "support/catch.h"
#include "watermark/small_owner.h"

using namespace fieldmark;

TEST_CASE("measured: JSON has the contract's keys, and null where there is no number", "[measured]") {
  watermark::Measurement m;
  m.bits = 16;
  m.views = 3;
  m.accuracy.blind = 0.75;
  m.psnr_base = std::nan("");
  m.lpips_base = 0.125;
  m.under["noise_0.05"].blind = 0.5;
  const auto json = cli::measurement_json(m, "ring");
  CHECK(json["bits"] == 16);
  CHECK(json["cameras"] == "ring");
  CHECK(json["accuracy"]["blind"] == 0.75);
  CHECK(json["accuracy"]["informed"].is_null());
  CHECK(json["psnr_base"].is_null());
  CHECK(json["lpips_base"] == 0.125);
  CHECK(json["distorted"]["noise_0.05"]["blind"] == 0.5);
  CHECK(json["distorted"]["noise_0.05"]["informed"].is_null());
  CHECK(json["informed_views"] == 0);
  m.accuracy.informed = 1;
  CHECK(cli::measurement_json(m, "ring")["accuracy"]["informed"] == 1);
  CHECK(cli::measurement_json(m, "ring")["accuracy"]["found"].is_null());
  m.accuracy.found = 0.75;
  CHECK(cli::measurement_json(m, "ring")["accuracy"]["found"] == 0.75);
}

TEST_CASE("measured: a row has the figures side by side", "[measured]") {
  watermark::Measurement m;
  m.views = 3;
  m.accuracy = {.blind = 0.75, .informed = 0.875, .chosen = 1};
  m.psnr_base_foreground = 36;
  m.under["blur_1"].blind = 0.5;
  const auto row = cli::measurement_row(m, "closer");
  CHECK(row["cameras"] == "closer");
  CHECK(row["views"] == 3);
  CHECK(row["blind"] == 0.75);
  CHECK(row["informed"] == 0.875);
  CHECK(row["chosen"] == 1);
  CHECK(row["psnr_base_foreground"] == 36);
  CHECK(row["blur_1 blind"] == 0.5);
  CHECK(row["blur_1 chosen"].is_null());
  for (const auto& [key, value] : row.items())
    CHECK_FALSE(value.is_structured());  // fits into a report's table
}

TEST_CASE("measured: people see the accuracies in percent", "[measured]") {
  watermark::Measurement m;
  m.accuracy.blind = 0.7512;
  m.under["blur_1"].blind = 0.5;
  std::ostringstream out;
  cli::print_measurement(out, m, "novel");
  CHECK_THAT(out.str(), Contains("75.12%"));
  CHECK_THAT(out.str(), Contains("blur_1") && !Contains("informed"));
  m.informed_views = 2;
  m.under["blur_1"].informed = 0.875;
  m.accuracy.found = 0.9;
  m.under["blur_1"].found = 0.625;
  cli::print_measurement(out, m, "novel");
  CHECK_THAT(out.str(), Contains("informed 87.50%"));
  CHECK_THAT(out.str(), Contains("found at p 1e-06     90.0% of single views"));
  CHECK_THAT(out.str(), Contains(", found 62.5%"));
}

TEST_CASE("measured: views to read informed are as given or usual, none without cells", "[measured]") {
  const auto cells = small_owner(), none = small_paper_owner();
  CHECK(cli::informed_views({}, 20, cells) == 20);
  CHECK(cli::informed_views(3, 20, cells) == 3);
  CHECK(cli::informed_views({}, 20, none) == 0);
  CHECK(cli::informed_views(0, 20, none) == 0);
  CHECK_THROWS_WITH(cli::informed_views(3, 20, none),
                    "--informed-count: an owner of preset paper has no cells in space");
}
