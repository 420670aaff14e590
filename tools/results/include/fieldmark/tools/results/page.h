#pragma once
#include <fieldmark/tools/results/rows.h>

#include <functional>

namespace fieldmark::results {

/// Files of docs/results by name: Markdown pages and their charts.
using Pages = std::map<std::string, std::string>;

/// Renders pages from rows alone. The template is Markdown with these directives:
///   %page FILE            starts the page FILE
///   %for, %end            see expanded()
///   [[ID PATH FORMAT]]    a figure of a row: PATH as in "accuracy/blind", FORMAT "%" for percent, ".2" for
///                         decimals, "g2" for significant digits, omitted for the raw value; "-" if it is
///                         missing
///   [[ID status]]         "fresh", or "stale"
///   %list ID[,ID] KEY [COLUMN...]   a table of the array KEY of the results
///   %chart FILE NAME ID[,ID]        result_chart() of the results, with arrays joined, and a link to it
///   %measured ID, %end-measured     lines that "Not measured." replaces if the row is missing
///   %provenance           commit, date, machine and state of every row that the page uses
/// @param stale  returns why a row must be measured again, empty if it is fresh
/// @throws ValueError if the template is malformed
Pages render_pages(std::string_view text, const Rows& rows,
                   const std::function<std::string(const std::string&)>& stale);
/// Returns the template of this project (tools/results/pages.md).
std::string_view project_pages();

}  // namespace fieldmark::results
