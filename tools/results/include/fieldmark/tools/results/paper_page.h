#pragma once
#include <fieldmark/baselines/cell.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace fieldmark::results {

/// Returns why a row must be measured again, by its ID; empty if it is fresh.
using StaleReason = std::function<std::string(const std::string& id)>;

/// Subfolder of a folder of cells, for those of longer budgets.
inline constexpr const char* kLongerCells = "longer";
/// The cells of a page: those of its tables, and those of longer budgets.
struct PaperCells {
  std::vector<baselines::Cell> tables, longer;
};
/// Loads the cells of a folder and, as the longer ones, those of its subfolder kLongerCells.
/// @throws IoError
PaperCells load_paper_cells(const std::filesystem::path& folder);

/// Formats the page of the paper's tables, our figures next to the published ones, from cells alone: equal
/// cells of equal state give equal pages.
/// @param figures  file names of paper_figures(), which the page shows
/// @param sheets   Markdown of the image sheets, inserted unchanged
/// @param stale    tells the state of each cell; null: the page names none
std::string paper_page(const PaperCells& cells, const std::vector<std::string>& figures,
                       const std::string& sheets, const StaleReason& stale = {});

/// Writes the page of the cells in a folder, with its figures and sheets next to it. Writes nothing if there
/// is no cell.
/// @param folder  holds the rows of `fieldmark reproduce`, see load_paper_cells()   @throws IoError
/// @param stale   see paper_page()
bool write_paper_page(const std::filesystem::path& folder, const std::filesystem::path& page,
                      const StaleReason& stale = {});

}  // namespace fieldmark::results
