#pragma once
#include <fieldmark/baselines/cell.h>

#include <span>

namespace fieldmark::baselines {

/// A row of the paper's tables.
struct PaperSystem {
  std::string name;           ///< in cells and their files
  std::string title;          ///< as the paper or we call it
  std::string what;           ///< a sentence on what is trained
  bool through_owner = true;  ///< an Owner is trained, see owner_system(); else a 2-D network
  bool ablation = false;      ///< another system but for a part
};
/// Every system that can be run, in the order of the tables.
std::span<const PaperSystem> paper_systems();
/// @throws ValueError if there is no such system
const PaperSystem& paper_system(std::string_view name);

/// The tables of the paper.
enum class PaperTable {
  bits,        ///< bit accuracy against the message's length
  quality,     ///< bit accuracy and quality at 16 bits
  distortion,  ///< bit accuracy at 16 bits under distortion of the images
  ablation,    ///< the full method without its parts
  sampling,    ///< other points along the rays at test
  weights      ///< noise on the weights
};
/// "bits" and so on, in the order of the enumeration.
std::span<const std::string_view> paper_table_names();
/// @throws ValueError if the name is none of them
PaperTable parse_paper_table(std::string_view name);

/// What is to be measured.
struct PlanOptions {
  std::vector<std::string> scenes;  ///< by name; the first has every system, the others the main ones
  std::uint64_t seed = 1;           ///< of the cells
  bool full = false;  ///< every length, scene and three seeds (seed, seed + 1, seed + 2) for every system
};

/// The cells of a table, each once, those of the first scene first. Lengths are 4, 8, 16, 32 and 48.
/// @throws ValueError if there is no scene
std::vector<CellName> plan_cells(PaperTable table, const PlanOptions& options);

}  // namespace fieldmark::baselines
