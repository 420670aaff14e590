#pragma once
#include <fieldmark/engine/shape.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::baselines {

/// What one measurement of the paper's tables is of.
struct CellName {
  std::string system;      ///< of paper_systems(): "copyrnerf_paper"
  std::string scene;       ///< of its folder: "lego"
  std::string field;       ///< "hash" or "mlp"
  Index bits = 16;         ///< length of the message
  std::uint64_t seed = 1;  ///< of every random choice
  /// "copyrnerf_paper-lego-hash-16-1": the file's name without its ending.
  std::string stem() const;
  /// Equal in every part.
  friend bool operator==(const CellName&, const CellName&) = default;
};

/// One measurement of the paper's tables; what was not measured is NaN. Accuracies are shares in [0, 1].
struct Cell {
  CellName name;                        ///< what it is of
  Index steps = 0;                      ///< of the system's own training, without the unmarked field's
  double seconds = 0;                   ///< of the same
  double bit_accuracy = 0;              ///< of one view from random novel cameras, mean over views
  double spread = 0;                    ///< standard deviation of the bit accuracy over views
  double own_2d_accuracy;               ///< of a 2-D network on the images that it marked itself
  double psnr_base = 0;                 ///< marked against unmarked render, dB, mean over views
  double psnr_base_foreground = 0;      ///< the same over the object's pixels
  double psnr_gt = 0;                   ///< marked render against ground truth of the test split, dB
  double ssim = 0;                      ///< marked render against ground truth
  double lpips = 0;                     ///< marked render against ground truth (AlexNet)
  std::map<std::string, double> under;  ///< bit accuracy under distortions, sampling and noise on weights
  std::string commit;                   ///< of the sources that measured it
  std::map<std::string, double> more;   ///< the protocol in numbers, and figures beside those above
};

/// A point of the course of a system's training.
struct CurvePoint {
  double seconds = 0;  ///< of training
  double steps = 0;    ///< taken
  double figure = 0;   ///< what the curve follows: of systems with a message, the share of bits right
};
/// Keeps the course of a run, as TrainingRun::curve() writes it, in Cell::more: at most 50 points, evenly
/// spread, the last among them, under names "learning SECONDS STEPS". @throws IoError if a line is no point
void keep_curve(Cell& cell, std::string_view curve);
/// What keep_curve() kept, in order of time; none where nothing was kept.
std::vector<CurvePoint> kept_curve(const Cell& cell);

/// JSON with the keys {system, scene, field, bits, seed, steps, seconds, bit_accuracy, spread,
/// own_2d_accuracy, psnr_base, psnr_base_foreground, psnr_gt, ssim, lpips, distorted, commit, more}; what is
/// not finite is null.
std::string format_cell(const Cell& cell);
/// What format_cell() wrote. @param place  named in errors   @throws IoError if the text is not a cell
Cell parse_cell(std::string_view text, std::string_view place);

/// Writes FOLDER/STEM.json when it is complete; the folder is made if need be. @throws IoError
void save_cell(const std::filesystem::path& folder, const Cell& cell);
/// The file of a cell in a folder, without its ending.
std::filesystem::path cell_path(const std::filesystem::path& folder, const CellName& name);
/// All *.json of a folder, by name; none where there is no folder.
/// @throws IoError if a file is not a cell, or its name is another's
std::vector<Cell> load_cells(const std::filesystem::path& folder);

}  // namespace fieldmark::baselines
