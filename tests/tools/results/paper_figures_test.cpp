#include <fieldmark/tools/results/paper_figures.h>

#include "support/catch.h"
#include "support/count_parts.h"
#include "support/temporary_folder.h"
#include "tools/paper_cells.h"

using namespace fieldmark;

TEST_CASE("Lines of lengths, of the severities that were measured, and of the course of training",
          "[paper_figures]") {
  auto cells = paper_cells();
  keep_curve(cells.back(), "seconds,steps,figure\n1.5,10,0.5\n3.0,20,0.75\n");
  const auto figures = results::paper_figures({cells, {}});
  REQUIRE(figures.size() == 5);  // nothing was rotated, scaled or blurred
  CHECK(count_parts(figures.at("paper_psnr.svg"), "class=\"point\"") == 2);
  CHECK_THAT(figures.at("paper_psnr.svg"), Contains("Fieldmark, preset fast, 100 steps"));
  // Two lengths of one system, and the paper's numbers at five lengths for the systems that can be run.
  CHECK(count_parts(figures.at("paper_bits.svg"), "class=\"point\"") % 5 == 2);
  CHECK_THAT(figures.at("paper_bits.svg"), Contains("CopyRNeRF, preset paper, published"));
  CHECK_THAT(figures.at("paper_bits.svg"), !Contains("Fieldmark"));
  CHECK(count_parts(figures.at("paper_noise.svg"), "class=\"point\"") ==
        2 * 3);  // no noise and two severities
  CHECK(count_parts(figures.at("paper_learning.svg"), "class=\"point\"") == 2);
  CHECK(count_parts(figures.at("paper_learning_ablation.svg"), "class=\"point\"") == 2);
  for (auto& c : cells) c.psnr_base = std::nan("");
  CHECK(!results::paper_figures({cells, {}}).contains("paper_psnr.svg"));
  CHECK(results::paper_figures({{}, {}}).size() == 1);  // only lengths that the paper reports
}

TEST_CASE("Figures are of the scene with most cells, and ablations are in their own", "[paper_figures]") {
  auto cells = paper_cells();
  keep_curve(cells.back(), "seconds,steps,figure\n1.5,10,0.5\n3.0,20,0.75\n");
  const auto add = [&](const char* system, const char* scene, const char* field) {
    cells.push_back(cells[2]);
    cells.back().name.system = system;
    cells.back().name.scene = scene;
    cells.back().name.field = field;
  };
  const auto before = results::paper_figures({cells, {}});
  add("nerf_message", "chair", "hash");
  add("copyrnerf_code", "lego", "mlp");
  CHECK(results::paper_figures({cells, {}}) == before);
  add("ours", "lego", "hash");  // another seed is not another length
  CHECK(results::paper_figures({cells, {}}).at("paper_bits.svg") == before.at("paper_bits.svg"));
  cells.pop_back();
  add("without_drr", "lego", "hash");
  const auto after = results::paper_figures({cells, {}});
  CHECK(after.at("paper_noise.svg") == before.at("paper_noise.svg"));
  CHECK(after.at("paper_learning.svg") == before.at("paper_learning.svg"));
  CHECK_THAT(after.at("paper_learning_ablation.svg"), Contains("CopyRNeRF without DRR"));
  CHECK_THAT(before.at("paper_noise.svg"), Contains("lego") && Contains("Fieldmark, preset fast"));
}

TEST_CASE("Preset paper has a curve for every scene and length, but for one seed", "[paper_figures]") {
  auto cells = paper_cells();
  for (auto& c : cells) keep_curve(c, "seconds,steps,figure\n1.5,10,0.5\n3.0,20,0.75\n");
  const auto before = results::paper_figures({cells, {}});
  CHECK_THAT(before.at("paper_learning_preset.svg"), Contains("lego, hash field, 4 bits, 100 steps") &&
                                                         Contains("lego, hash field, 16 bits, 100 steps"));
  CHECK(count_parts(before.at("paper_learning_preset.svg"), "class=\"point\"") == 4);
  cells.push_back(cells[1]);
  cells.back().name.seed = 2;
  CHECK(results::paper_figures({cells, {}}) == before);
}

TEST_CASE("A 2-D network is named in the learning curves, and drawn once", "[paper_figures]") {
  auto cells = paper_cells();
  cells.push_back(cells.back());
  cells.back().name.system = "nerf_hidden";
  cells.back().own_2d_accuracy = 0.99;
  keep_curve(cells.back(), "seconds,steps,figure\n1.5,10,0.5\n3.0,20,0.75\n");
  cells.push_back(cells.back());
  cells.back().name.system = "hidden_nerf";
  cells.back().more["training_images_accuracy"] = 0.99;
  const auto curves = results::paper_figures({cells, {}}).at("paper_learning.svg");
  CHECK(count_parts(curves, "class=\"point\"") == 2);
  CHECK_THAT(curves, Contains("NeRF + HiDDeN, its 2-D network"));
}

TEST_CASE("The sheet has a row for each image of a cell of 16 bits", "[paper_figures]") {
  const TemporaryFolder folder;
  const results::PaperSheet all = results::paper_sheets().front(), residual = results::paper_sheets().back();
  CHECK(results::write_paper_sheet(all, paper_cells(), folder.path, folder / "sheet.png").empty());
  CHECK(folder.entries() == 0);
  Tensor<float> both({2, 6, 3}, 0.2f);
  for (Index p = 0; p < 12; ++p)
    for (Index c = 0; c < 3; ++c)
      if (p % 6 >= 3) both[3 * p + c] = 0.24f;
  write_png(folder / "ours-lego-hash-16-1.png", both);
  const auto rows = results::write_paper_sheet(all, paper_cells(), folder.path, folder / "sheet.png");
  CHECK(rows == std::vector<std::string>{"ours-lego-hash-16-1"});
  const auto sheet = read_image(folder / "sheet.png");
  CHECK(sheet.shape == Shape{2, 3 * 3 + 2 * 4, 3});
  CHECK(sheet[0] == 51 / 255.f);
  CHECK(sheet[3 * 7] == 61 / 255.f);
  CHECK(sheet[3 * 14] == Approx(0.5 + 10 * 10 / 255.0).margin(0.002));
  // Thirty times the difference, for the 2-D networks on renders alone.
  CHECK(residual.name == "paper_residual.png");
  CHECK(results::write_paper_sheet(residual, paper_cells(), folder.path, folder / "residual.png").empty());
  auto cells = paper_cells();
  cells.back().name.system = "nerf_mbrs";
  for (Index p = 0; p < 12; ++p) both[3 * p] = 0.2f + (p % 6 >= 3 ? 3 / 255.f : 0.f);
  write_png(folder / "nerf_mbrs-lego-hash-16-1.png", both);
  CHECK(results::write_paper_sheet(residual, cells, folder.path, folder / "residual.png").size() == 1);
  CHECK(read_image(folder / "residual.png")[3 * 14] == Approx(0.5 + 30 * 3 / 255.0).margin(0.002));
}
