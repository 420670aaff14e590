#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/tools/results/paper_page.h>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/paper_cells.h"

using namespace fieldmark;

TEST_CASE("The paper's page has our figures beside the published ones", "[paper_page]") {
  const std::string page = results::paper_page(paper_cells(), {"paper_bits.svg"}, "A note.\n");
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
  CHECK(page == results::paper_page(paper_cells(), {"paper_bits.svg"}, "A note.\n"));
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
  const std::string page = results::paper_page({}, {}, "");
  CHECK_THAT(page, Contains("CopyRNeRF without DRR") && Contains("No cell has been measured."));
}
