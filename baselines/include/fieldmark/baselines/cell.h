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

/// Identifies one measurement of the paper's tables.
struct CellName {
  std::string system;      ///< name from paper_systems(): "copyrnerf_paper"
  std::string scene;       ///< name of its folder: "lego"
  std::string field;       ///< "hash" or "mlp"
  Index bits = 16;         ///< length of the message
  std::uint64_t seed = 1;  ///< seeds every random choice
  /// Returns the file name without its extension: "copyrnerf_paper-lego-hash-16-1".
  std::string stem() const;
  /// True if every part is equal.
  friend bool operator==(const CellName&, const CellName&) = default;
};

/// One measurement of the paper's tables; unmeasured values are NaN. Accuracies are fractions in [0, 1].
struct Cell {
  CellName name;                        ///< which measurement this is
  Index steps = 0;                      ///< of the system's own training, without the unmarked field's
  double seconds = 0;                   ///< duration of the same training
  double bit_accuracy = 0;              ///< of one view from random novel cameras, mean over views
  double spread = 0;                    ///< standard deviation of the bit accuracy over views
  double own_2d_accuracy;               ///< of a 2-D network on the images that it marked itself
  double psnr_base = 0;                 ///< marked against unmarked render, dB, mean over views
  double psnr_base_foreground = 0;      ///< the same over the object's pixels
  double psnr_gt = 0;                   ///< marked render against ground truth of the test split, dB
  double ssim = 0;                      ///< marked render against ground truth
  double lpips = 0;                     ///< marked render against ground truth (AlexNet)
  std::map<std::string, double> under;  ///< bit accuracy under distortions, sampling and noise on weights
  std::string commit;                   ///< commit of the sources that measured it
  std::map<std::string, double> more;   ///< the protocol in numbers, and further figures
};

/// A point of a system's learning curve.
struct CurvePoint {
  double seconds = 0;  ///< training time so far
  double steps = 0;    ///< steps so far
  double figure = 0;   ///< the quantity plotted: bit accuracy for systems with a message
};
/// Stores the curve of a run, as written by TrainingRun::curve(), in Cell::more: at most 50 evenly spread
/// points, including the last, under names "learning SECONDS STEPS". @throws IoError if a line is malformed
void keep_curve(Cell& cell, std::string_view curve);
/// Returns the points that keep_curve() stored, in order of time; empty if it stored none.
std::vector<CurvePoint> kept_curve(const Cell& cell);

/// Formats a cell as JSON with the keys {system, scene, field, bits, seed, steps, seconds, bit_accuracy,
/// spread, own_2d_accuracy, psnr_base, psnr_base_foreground, psnr_gt, ssim, lpips, distorted, commit, more}.
/// Non-finite numbers become null.
std::string format_cell(const Cell& cell);
/// Parses the output of format_cell(). @param place  named in errors   @throws IoError if it is not a cell
Cell parse_cell(std::string_view text, std::string_view place);

/// Writes FOLDER/STEM.json atomically; creates the folder if needed. @throws IoError
void save_cell(const std::filesystem::path& folder, const Cell& cell);
/// Returns the path of a cell in a folder, without extension.
std::filesystem::path cell_path(const std::filesystem::path& folder, const CellName& name);
/// Loads all *.json of a folder, sorted by name; returns an empty vector if the folder does not exist.
/// @throws IoError if a file is not a cell, or its name belongs to another cell
std::vector<Cell> load_cells(const std::filesystem::path& folder);

}  // namespace fieldmark::baselines
