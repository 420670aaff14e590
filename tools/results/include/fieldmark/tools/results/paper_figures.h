#pragma once
#include <fieldmark/baselines/cell.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace fieldmark::results {

/// SVG files by name: accuracy against length, severity curves and, against seconds, the learning curves of
/// the cells of 16 bits, see kept_curve(), those of ablations in a figure of their own. All of the scene with
/// most cells, on the hash field. Figures without a point are left out.
std::map<std::string, std::string> paper_figures(const std::vector<baselines::Cell>& measured);

/// An image of the page.
struct PaperSheet {
  std::string name;                  ///< of its file: "paper_residual.png"
  std::vector<std::string> systems;  ///< whose cells it shows
  float gain = 10;                   ///< of the differences
};
/// The systems' cells and the ablations' with ten times the differences; thirty times what HiDDeN and MBRS
/// put into renders, where the paper's figure shows traces in empty areas.
const std::vector<PaperSheet>& paper_sheets();
/// Writes a contact sheet of the cells' STEM.png: unmarked, marked, the difference enlarged, a row for each
/// cell of 16 bits; nothing where there is none.
/// @return the stems of the rows, from the top   @throws IoError
std::vector<std::string> write_paper_sheet(const PaperSheet& sheet, const std::vector<baselines::Cell>& cells,
                                           const std::filesystem::path& folder,
                                           const std::filesystem::path& file);

}  // namespace fieldmark::results
