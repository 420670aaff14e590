#pragma once
#include <fieldmark/baselines/cell.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::results {

/// Returns why a row must be measured again, by its ID; empty if it is fresh.
using StaleReason = std::function<std::string(const std::string& id)>;

/// Formats the page of the paper's tables, our figures next to the published ones, from cells alone: equal
/// cells of equal state give equal pages.
/// @param figures  file names of paper_figures(), which the page shows
/// @param sheets   Markdown of the image sheets, inserted unchanged
/// @param stale    tells the state of each cell; null: the page names none
std::string paper_page(const std::vector<baselines::Cell>& cells, const std::vector<std::string>& figures,
                       const std::string& sheets, const StaleReason& stale = {});

/// Writes the page of the cells in a folder, with its figures and sheets next to it. Writes nothing if there
/// is no cell.
/// @param folder  holds the rows of `fieldmark reproduce`   @throws IoError
/// @param stale   see paper_page()
bool write_paper_page(const std::filesystem::path& folder, const std::filesystem::path& page,
                      const StaleReason& stale = {});

}  // namespace fieldmark::results
