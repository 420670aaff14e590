#include <fieldmark/tools/results/paper_page.h>

#include "support/catch.h"
#include "tools/paper_cells.h"

using namespace fieldmark;

TEST_CASE("The paper's page has our figures beside the published ones", "[paper_page]") {
  const std::string page = results::paper_page(paper_cells(), {"paper_bits.svg"}, "A note.\n");
  CHECK_THAT(page, Contains("16 bits, lego, hash field.\n\n") &&
                       Contains("| CopyRNeRF, preset paper | 50.00 ± 0.62 (91.16) | 30.00 (26.29) | 38.50 | "
                                "100 | 1.0 |"));
  CHECK_THAT(page, Contains("| CopyRNeRF, preset paper | lego | hash | 75.00 ± 0.62 (100.00), 100 | - | "
                            "50.00 ± 0.62 (91.16), 100 | - | - |"));
  CHECK_THAT(page, Contains("| Fieldmark, preset fast | lego | hash | - | - | 98.44 ± 0.62, 100 |"));
  CHECK_THAT(page, Contains("| 38.50 | 34.25 | - | - | 30.00 (26.29) | - | 0.750 (0.910) | - (0.038) |"));
  CHECK_THAT(page, Contains("## Departures") && Contains("| N_m | 256 | 128 | 256 | 128 |"));
  CHECK_THAT(page, Contains("| steps | none | noise_0.05 | noise_0.1 |"));
  CHECK_THAT(page, Contains("| 100 | 50.00 (91.16) | 46.88 | 37.50 (90.44) |"));
  CHECK_THAT(page,
             Contains("![paper_bits.svg](paper_bits.svg)") && Contains("A note.\n") && Contains("ICCV 2023"));
  CHECK_THAT(page, Contains("| copyrnerf_paper-lego-hash-16-1 | 100 | 60.0 | 90 |"));
  CHECK_THAT(page, Contains("In all 3 cells, 0.07 hours."));
  CHECK_THAT(page, Contains("Fieldmark without cells") && Contains("## Cameras of the authors' code"));
  CHECK(page == results::paper_page(paper_cells(), {"paper_bits.svg"}, "A note.\n"));
}

TEST_CASE("Cells that differ in the seed are one row", "[paper_page]") {
  auto cells = paper_cells();
  cells.push_back(cells.back());
  cells.back().name.seed = 2;
  cells.back().bit_accuracy = 0.953125;
  CHECK_THAT(results::paper_page(cells, {}, ""), Contains("96.88 ± 1.56, 2 seeds"));
}

TEST_CASE("Another order than the paper's is told beyond two standard errors only", "[paper_page]") {
  auto cells = paper_cells();
  cells.back().name.system = "geometry";  // 60.16% in the paper, below the 91.16% of preset paper
  CHECK_THAT(
      results::paper_page(cells, {}, ""),
      Contains("CopyRNeRF, preset paper (50.00%, 100 steps) stands below CopyRNeRF in geometry (98.44%"));
  cells.back().bit_accuracy = 0.515;
  CHECK_THAT(results::paper_page(cells, {}, ""), !Contains("stands below"));
}

TEST_CASE("A page without cells names the systems all the same", "[paper_page]") {
  const std::string page = results::paper_page({}, {}, "");
  CHECK_THAT(page, Contains("CopyRNeRF without DRR") && Contains("No cell has been measured."));
}
