#include "cli/embed_rows.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include <cmath>

#include "cli/report.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

namespace {
bench::EmbedRow row(const char* choice, double accuracy) {
  bench::EmbedRow r;
  r.variant.choice = choice;
  r.variant.setting = "so";
  r.steps = 7;
  r.cache_seconds = 1;
  r.seconds = 60.25;
  r.accuracy = accuracy;
  r.accuracy_p5 = 0.5;
  r.psnr_foreground = 36.125;
  r.closer = 0.75;
  r.farther = 0.625;
  r.unseen = std::nan("");
  r.figures = {.sign = 0.1, .index = 0.2, .bits = 0.3, .loss = 0};
  r.curve = {{30, 0.6, 35}, {60.25, accuracy, 36.125}};
  return r;
}
}  // namespace

TEST_CASE("embed_rows: rows come back as they were added, with the commit they were measured with",
          "[bench]") {
  const TemporaryFolder folder;
  const cli::Json configuration{{"field", "a.fm"}, {"seconds", 60}};
  {
    cli::EmbedRows rows(folder / "rows.json", configuration);
    CHECK(rows.rows().empty());
    rows.add(row("default", 0.9));
    rows.add(row("length", 0.8));
  }
  const cli::EmbedRows rows(folder / "rows.json", configuration);
  REQUIRE(rows.rows().size() == 2);
  const bench::EmbedRow &a = rows.rows()[1], b = row("length", 0.8);
  CHECK(a.variant.choice == "length");
  CHECK(a.variant.setting == "so");
  CHECK(a.steps == 7);
  CHECK(a.cache_seconds == b.cache_seconds);
  CHECK(a.seconds == b.seconds);
  CHECK(a.accuracy == b.accuracy);
  CHECK(a.accuracy_p5 == b.accuracy_p5);
  CHECK(a.psnr_foreground == b.psnr_foreground);
  CHECK(a.closer == b.closer);
  CHECK(a.farther == b.farther);
  CHECK(std::isnan(a.unseen));
  CHECK(a.figures.sign == 0.1);
  CHECK(a.figures.index == 0.2);
  CHECK(a.figures.bits == 0.3);
  REQUIRE(a.curve.size() == 2);
  CHECK(a.curve[0].accuracy == 0.6);
  CHECK(a.curve[1].seconds == 60.25);
  CHECK(rows.commit_of(b) == cli::machine().commit);
  CHECK(rows.commit_of(row("cells", 0)).empty());
}

TEST_CASE("embed_rows: files of other settings and other files are refused", "[bench]") {
  const TemporaryFolder folder;
  cli::EmbedRows(folder / "rows.json", {{"seconds", 60}}).add(row("default", 0.9));
  CHECK_THROWS_WITH(cli::EmbedRows(folder / "rows.json", {{"seconds", 61}}),
                    Contains("rows.json: configuration: expected {\"seconds\":61}, found {\"seconds\":60}"));
  for (const char* text : {"", "[]", "{}", "{\"configuration\":{\"seconds\":60},\"rows\":[{}]}"}) {
    write_file_atomically(folder / "other.json", std::string_view(text));
    CHECK_THROWS_WITH(cli::EmbedRows(folder / "other.json", {{"seconds", 60}}),
                      Contains("other.json: expected rows of bench embed, found"));
  }
  CHECK(cli::EmbedRows("", {{"seconds", 60}}).rows().empty());
}
