#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/tools/results/paper_figures.h>
#include <fieldmark/tools/results/paper_page.h>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/paper_cells.h"

using namespace fieldmark;

TEST_CASE("The paper's page has our figures beside the published ones", "[paper_page]") {
  const std::string page = results::paper_page({paper_cells(), {}}, {"paper_bits.svg"}, "A note.\n");
  CHECK_THAT(page, Contains("A message of 16 bits on the scene lego") &&
                       Contains("| CopyRNeRF, preset paper | 50.00 ± 0.62 (91.16) | 30.00 (26.29) | 38.50 | "
                                "100 | 1.0 | tie |") &&
                       Contains("| 38.50 | 100 | 1.0 | above |"));
  CHECK_THAT(page, Contains("| CopyRNeRF, preset paper | lego | hash | 75.00 ± 0.62 (100.00), 100 | - | "
                            "50.00 ± 0.62 (91.16), 100 | - | - |"));
  CHECK_THAT(page, Contains("| Fieldmark, preset fast | lego | hash | - | - | 98.44 ± 0.62, 100 |"));
  CHECK_THAT(page, Contains("| 38.50 | 34.25 | - | - | 30.00 (26.29) | - | 0.750 (0.910) | - (0.038) |"));
  CHECK_THAT(page, Contains("## Departures") && Contains("| N_m | 256 | 128 | 256 | 128 |"));
  CHECK_THAT(page, Contains("| steps | none | noise_0.05 | noise_0.1 |"));
  CHECK_THAT(page, Contains("| 100 | 50.00 (91.16) | 46.88 | 37.50 (90.44) |"));
  CHECK_THAT(page,
             Contains("![paper_bits.svg](paper_bits.svg)") && Contains("A note.\n") && Contains("ICCV 2023"));
  CHECK_THAT(page, Contains("| lego | hash | 60 | 100 | 50.00 ± 0.62 (91.16) |"));  // budget, steps
  CHECK_THAT(page, Contains("| copyrnerf_paper-lego-hash-16-1 | 100 | 60.0 | 90 | 60 |"));
  CHECK_THAT(page, Contains("In all 3 cells, 0.07 hours."));
  CHECK_THAT(page, Contains("Fieldmark without cells") && Contains("## Cameras of the authors' code"));
  CHECK_THAT(page, !Contains("Longer budgets"));
  CHECK(page == results::paper_page({paper_cells(), {}}, {"paper_bits.svg"}, "A note.\n"));
}

TEST_CASE("Cells of a longer budget stand below their row of the tables, and in no other table",
          "[paper_page]") {
  const TemporaryFolder folder;
  auto cells = paper_cells();
  for (const auto& c : cells) baselines::save_cell(folder.path, c);
  baselines::Cell& longer = cells[1];
  REQUIRE(longer.name.system == "copyrnerf_paper");
  longer.steps = 400, longer.bit_accuracy = 0.5625, longer.under = {{"rotation_30", 0.53125}};
  longer.more = {{"total_seconds", 300}, {"budget", 240}, {"views", 100}, {"learning 200.0 300", 0.55}};
  baselines::save_cell(folder / results::kLongerCells, longer);

  const auto loaded = results::load_paper_cells(folder.path);
  CHECK(loaded.tables.size() == 3);
  REQUIRE(loaded.longer.size() == 1);
  const std::string page =
      results::paper_page(loaded, {}, "", [](const std::string& id) { return "reason of " + id; });
  CHECK_THAT(page,
             Contains("## Longer budgets") &&
                 Contains("| CopyRNeRF, preset paper | lego | hash | 60 | 100 | 16 | 50.00 ± 0.62 | - | - "
                          "| 38.50 | 30.00 |\n"
                          "| CopyRNeRF, preset paper | lego | hash | 240 | 400 | 16 | 56.25 ± 0.62 | "
                          "53.12 | - | 38.50 | 30.00 |"));
  CHECK_THAT(page, Contains("stale: reason of paper/longer/copyrnerf_paper-lego-hash-16-1 |") &&
                       Contains("In all 4 cells, 0.16 hours."));
  const std::string before = page.substr(0, page.find("## Longer budgets"));
  CHECK_THAT(before, !Contains("56.25") && !Contains("53.12"));

  const auto figures = results::paper_figures(loaded);
  CHECK_THAT(figures.at("paper_learning_longer.svg"),
             Contains("CopyRNeRF, preset paper, lego, hash field, 16 bits, 400 steps"));
  CHECK(!results::paper_figures({loaded.tables, {}}).contains("paper_learning_longer.svg"));
  CHECK(figures.size() == results::paper_figures({loaded.tables, {}}).size() + 1);
}

TEST_CASE("The rows of a sheet are labelled on the page", "[paper_page]") {
  const TemporaryFolder folder;
  for (const auto& c : paper_cells()) baselines::save_cell(folder.path, c);
  write_png(folder / "ours-lego-hash-16-1.png", Tensor<float>({2, 6, 3}, 0.2f));
  REQUIRE(results::write_paper_page(folder.path, folder / "paper.md"));
  CHECK_THAT(read_text(folder / "paper.md"),
             Contains("### paper_images.png") &&
                 Contains("| 1 | Fieldmark, preset fast | lego | hash | 100 | 98.44 | 38.50 |"));
}

TEST_CASE("A page without cells names the systems all the same", "[paper_page]") {
  const std::string page = results::paper_page({{}, {}}, {}, "");
  CHECK_THAT(page, Contains("CopyRNeRF without DRR") && Contains("No cell has been measured."));
}
