#pragma once
#include <fieldmark/baselines/cell.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace fieldmark::cli {

/// SVG files by name: accuracy against length, severity curves and the learning curves (see run_curve()) of
/// the cells whose STEM.csv lies in `folder`. Figures without a point are left out.
std::map<std::string, std::string> paper_figures(const std::vector<baselines::Cell>& cells,
                                                 const std::filesystem::path& folder);

/// Writes a contact sheet of the cells' STEM.png: unmarked, marked, ten times the difference, a row for each
/// cell of 16 bits; nothing where there is none.
/// @return the stems of the rows, from the top   @throws IoError
std::vector<std::string> write_paper_sheet(const std::vector<baselines::Cell>& cells,
                                           const std::filesystem::path& folder,
                                           const std::filesystem::path& file);

}  // namespace fieldmark::cli
