#pragma once
#include <fieldmark/baselines/cell.h>

#include <span>

namespace fieldmark::baselines {

/// A row of the paper's tables.
struct PaperSystem {
  std::string name;           ///< name in cells and their files
  std::string title;          ///< the paper's name or ours
  std::string what;           ///< one sentence on what is trained
  bool through_owner = true;  ///< true: trains an Owner, see owner_system(); false: a 2-D network
  bool ablation = false;      ///< true if it is another system without one part
};
/// Returns every system that can be run, in the order of the tables.
std::span<const PaperSystem> paper_systems();
/// Returns the system of a name. @throws ValueError if there is no such system
const PaperSystem& paper_system(std::string_view name);

/// The tables of the paper.
enum class PaperTable {
  bits,        ///< bit accuracy against message length
  quality,     ///< bit accuracy and quality at 16 bits
  distortion,  ///< bit accuracy at 16 bits under distortion of the images
  ablation,    ///< the full method with parts removed
  sampling,    ///< other sampling along the rays at test time
  weights      ///< noise on the weights
};
/// Returns the names of the tables ("bits", ...) in the order of the enumeration.
std::span<const std::string_view> paper_table_names();
/// Parses the name of a table. @throws ValueError if the name is unknown
PaperTable parse_paper_table(std::string_view name);

/// Options for planning measurements.
struct PlanOptions {
  std::vector<std::string> scenes;  ///< names; the first scene gets every system, the others the main ones
  std::uint64_t seed = 1;           ///< seed of the cells
  bool full = false;  ///< every length, scene and three seeds (seed, seed + 1, seed + 2) for every system
};

/// Returns the cells of a table without duplicates, first scene first. Lengths are 4, 8, 16, 32 and 48.
/// @throws ValueError if there is no scene
std::vector<CellName> plan_cells(PaperTable table, const PlanOptions& options);

}  // namespace fieldmark::baselines
