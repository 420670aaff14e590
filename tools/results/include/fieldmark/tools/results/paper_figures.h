#pragma once
#include <fieldmark/baselines/cell.h>
#include <fieldmark/tools/results/paper_page.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace fieldmark::results {

/// Returns SVG files by name, of one seed of each cell: accuracy against length, against severity and against
/// PSNR, and learning curves over seconds, see kept_curve(), with ablations in a figure of their own. They
/// show the scene with the most cells, on the hash field; paper_learning_preset.svg shows every cell of
/// preset paper, and paper_learning_longer.svg the longer cells. Figures without points are omitted.
std::map<std::string, std::string> paper_figures(const PaperCells& measured);

/// A contact sheet shown on the page.
struct PaperSheet {
  std::string name;                  ///< file name: "paper_residual.png"
  std::vector<std::string> systems;  ///< systems whose cells it shows
  float gain = 10;                   ///< scale of the differences
};
/// Returns the sheets: systems and ablations with differences scaled by ten, and HiDDeN and MBRS on renders
/// with differences scaled by thirty, where the paper's figure shows traces in empty areas.
const std::vector<PaperSheet>& paper_sheets();
/// Writes a contact sheet of the cells' STEM.png, one row per cell of 16 bits: unmarked, marked, and the
/// magnified difference. Writes nothing if there is no such cell.
/// @return the stems of the rows, top to bottom   @throws IoError
std::vector<std::string> write_paper_sheet(const PaperSheet& sheet, const std::vector<baselines::Cell>& cells,
                                           const std::filesystem::path& folder,
                                           const std::filesystem::path& file);

}  // namespace fieldmark::results
