#include "paper_tables.h"
#include "support/catch.h"
#include "tools/paper_cells.h"

using namespace fieldmark;

TEST_CASE("Cells that differ in the seed are one row", "[paper_tables]") {
  auto cells = paper_cells();
  cells.push_back(cells.back());
  cells.back().name.seed = 2;
  cells.back().bit_accuracy = 0.953125;
  CHECK_THAT(results::first_table(results::paper_groups(cells)), Contains("96.88 ± 1.56, 2 seeds"));
}

TEST_CASE("Another order than the paper's is told beyond two standard errors only", "[paper_tables]") {
  auto cells = paper_cells();
  cells.back().name.system = "geometry";  // 60.16% in the paper, below the 91.16% of preset paper
  const auto order = [&] { return results::order_of_rows(results::paper_groups(cells)); };
  CHECK_THAT(
      order(),
      Contains("CopyRNeRF, preset paper (50.00%, 100 steps) stands below CopyRNeRF in geometry (98.44%"));
  cells.back().bit_accuracy = 0.515;
  CHECK_THAT(order(),
             !Contains("stands below") &&
                 Contains("- lego, hash field: CopyRNeRF, preset paper (50.00%, 100 steps) and CopyRNeRF in "
                          "geometry (51.50%, 100 steps); the paper has 91.16% above 60.16%"));
  cells.back().bit_accuracy = 0.4;  // in the paper's order
  CHECK_THAT(order(), !Contains("geometry (40.00%"));
}

TEST_CASE("A system with one message is compared with none", "[paper_tables]") {
  auto cells = paper_cells();
  cells.back().name.system = "hidden_nerf";
  cells.back().more["training_images_accuracy"] = 0.99;
  const auto groups = results::paper_groups(cells);
  CHECK_THAT(results::order_of_rows(groups), !Contains("HiDDeN"));
  CHECK_THAT(results::first_table(groups), Contains("| 38.50 | 100 | 1.0 | - |"));
}

TEST_CASE("A cell's state stands beside its protocol", "[paper_tables]") {
  const results::PaperCells cells{paper_cells(), {}};
  const auto table = [&](const results::StaleReason& stale) { return results::protocol_table(cells, stale); };
  CHECK_THAT(table({}), Contains("| pixels | commit |\n"));
  const std::string told = table([](const std::string& id) {
    return id == "paper/ours-lego-hash-16-1" ? std::string("code changed") : std::string();
  });
  CHECK_THAT(told, Contains("| commit | state |\n"));
  CHECK_THAT(told, Contains("| abc | stale: code changed |\n"));
  CHECK_THAT(told, Contains("| abc | fresh |\n"));
}

TEST_CASE("The ablation is of one scene", "[paper_tables]") {
  auto cells = paper_cells();
  cells.push_back(cells.back());
  cells.back().name.scene = "chair";
  CHECK_THAT(results::ablation_table(results::paper_groups(cells)),
             Contains("| lego |") && !Contains("chair"));
  cells.back().name = {"cold_start", "lego", "hash", 16, 1};
  CHECK_THAT(results::ablation_table(results::paper_groups(cells)), Contains("CopyRNeRF, cold start"));
}
