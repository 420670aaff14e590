#include <fieldmark/baselines/cell.h>
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include <cmath>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {
Cell sample() {
  return {.name = {"hidden_nerf", "lego", "hash", 16, 3},
          .steps = 1200,
          .seconds = 61.5,
          .bit_accuracy = 0.5,
          .spread = 0.1,
          .own_2d_accuracy = 0.98,
          .psnr_base = 31.25,
          .psnr_base_foreground = 26,
          .psnr_gt = 27,
          .ssim = 0.9,
          .lpips = std::nan(""),
          .under = {{"noise_0.1", 0.5}, {"blur_1", 0.25}},
          .commit = "abc",
          .more = {{"views", 200}}};
}
}  // namespace

TEST_CASE("cell: the course of training is kept in it, thinned out, and comes back") {
  std::string curve = "seconds,steps,figure\n";
  for (int k = 1; k <= 120; ++k)
    curve +=
        std::to_string(k) + ".5," + std::to_string(10 * k) + "," + std::to_string(0.5 + 0.004 * k) + "\n";
  Cell cell = sample();
  CHECK(kept_curve(cell).empty());
  keep_curve(cell, curve);
  const auto points = kept_curve(parse_cell(format_cell(cell), "here"));
  REQUIRE(points.size() == 50);
  CHECK(points.front().seconds < 4);
  CHECK(points.back().seconds == 120.5);
  CHECK(points.back().steps == 1200);
  CHECK(points.back().figure == Approx(0.98));
  for (std::size_t k = 1; k < points.size(); ++k) CHECK(points[k].seconds > points[k - 1].seconds);
  keep_curve(cell = sample(), "seconds,steps,figure\n1.0,2,nan\n");
  CHECK(kept_curve(cell).size() == 1);
  CHECK_THROWS_WITH(keep_curve(cell, "seconds,steps,figure\nmany\n"),
                    "hidden_nerf-lego-hash-16-3: expected a point of its course, found 'many'");
}

TEST_CASE("cell: the keys that scripts read, null where nothing was measured") {
  const std::string text = format_cell(sample());
  std::size_t at = 0;
  for (const char* key : {"system", "scene", "field", "bits", "seed", "steps", "seconds", "bit_accuracy",
                          "spread", "own_2d_accuracy", "psnr_base", "psnr_base_foreground", "psnr_gt", "ssim",
                          "lpips", "distorted", "commit"}) {
    const std::size_t found = text.find("\"" + std::string(key) + "\":", at);
    CAPTURE(key);
    REQUIRE(found != std::string::npos);
    at = found;
  }
  CHECK_THAT(text, Contains("\"lpips\": null") && Contains("\"blur_1\": 0.25") && Contains("\"seed\": 3"));
}

TEST_CASE("cell: written, read back and listed by name") {
  const TemporaryFolder folder;
  const std::filesystem::path cells = folder / "made/when/needed";
  CHECK(load_cells(cells).empty());
  Cell other = sample();
  other.name.bits = 4;
  save_cell(cells, other);
  save_cell(cells, sample());
  const auto read = load_cells(cells);
  REQUIRE(read.size() == 2);
  CHECK(read[0].name == sample().name);  // "-16-" before "-4-"
  CHECK(read[1].name == other.name);
  CHECK(format_cell(read[0]) == format_cell(sample()));
  CHECK(std::isnan(read[0].lpips));
}

TEST_CASE("cell: a file that is not one is named") {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a.json", "{\"system\": 3}");
  CHECK_THROWS_WITH(load_cells(folder / ""),
                    Contains("a.json: expected a cell of `fieldmark reproduce`, found"));
  write_file_atomically(folder / "a.json", format_cell(sample()));
  CHECK_THROWS_WITH(load_cells(folder / ""), Contains("a.json: expected the cell of this name, found that of "
                                                      "hidden_nerf-lego-hash-16-3"));
  CHECK_THROWS_AS(parse_cell("", "x"), IoError);
}
