#pragma once
#include <fieldmark/baselines/cell.h>

#include <string>
#include <vector>

namespace fieldmark::results {

/// Formats the page of the paper's tables, our figures next to the published ones, from cells alone: equal
/// cells give equal pages.
/// @param figures  file names of paper_figures(), which the page shows
/// @param sheets   Markdown of the image sheets, inserted unchanged
std::string paper_page(const std::vector<baselines::Cell>& cells, const std::vector<std::string>& figures,
                       const std::string& sheets);

/// Writes the page of the cells in a folder, with its figures and sheets next to it. Writes nothing if there
/// is no cell.
/// @param folder  holds the rows of `fieldmark reproduce`   @throws IoError
bool write_paper_page(const std::filesystem::path& folder, const std::filesystem::path& page);

}  // namespace fieldmark::results
