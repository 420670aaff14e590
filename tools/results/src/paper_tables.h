#pragma once
// The tables of the paper's page, in Markdown. Private.
#include <fieldmark/baselines/cell.h>
#include <fieldmark/tools/results/paper_page.h>

#include <string>
#include <vector>

namespace fieldmark::results {

/// Formats a number with a fixed count of digits; "-" unless it is finite.
std::string fixed(double value, int digits);
/// Formats a share as a percentage with two digits.
std::string percent(double share);

/// True if the system marks the training images with a single message and its complement. Views are then no
/// sample of messages, and another cell shows the same 2-D network on renders.
bool marks_training_images(const baselines::Cell& cell);

/// Cells that differ in their seeds alone.
struct PaperGroup {
  std::string system, title, scene, field;
  Index bits;
  std::vector<const baselines::Cell*> cells;
};
/// Groups the cells by system, in the order of paper_systems(), then in their own order. The cells must
/// outlive the groups.
std::vector<PaperGroup> paper_groups(const std::vector<baselines::Cell>& cells);

/// The systems at 16 bits on the hash field, on the scene that most of them have.
std::string first_table(const std::vector<PaperGroup>& groups);
/// Accuracy for each length of the message.
std::string bits_table(const std::vector<PaperGroup>& groups);
/// Accuracy and image quality at 16 bits.
std::string quality_table(const std::vector<PaperGroup>& groups);
/// Accuracy at 16 bits under each distortion.
std::string distortion_table(const std::vector<PaperGroup>& groups);
/// CopyRNeRF and ours with and without their parts, on the scene of first_table().
std::string ablation_table(const std::vector<PaperGroup>& groups);
/// Each group of longer cells below the group of the tables that differs from it in the budget alone.
std::string longer_table(const std::vector<PaperGroup>& longer, const std::vector<PaperGroup>& groups);
/// One column for each name of Cell::under that begins with the prefix, beside the published figures of a
/// table.
std::string named_table(const std::vector<PaperGroup>& groups, const char* table, const std::string& prefix);
/// Lists the pairs whose order in the paper our figures reverse, and those that they leave open.
std::string order_of_rows(const std::vector<PaperGroup>& groups);
/// How each cell was measured, and whether it is stale, see paper_page().
std::string protocol_table(const PaperCells& cells, const StaleReason& stale);

}  // namespace fieldmark::results
