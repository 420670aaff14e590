#pragma once
#include <fieldmark/imaging/pareto.h>
#include <fieldmark/tools/bench/field_variants.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// A variant compared with the reference.
struct FieldRow {
  FieldVariant variant;  ///< how it was rendered
  /// Seconds per view, mean over the views. The time of a view is its ratio to the default timed right before
  /// it, median over the runs, times the default's median.
  double seconds = 0;
  double spread = 0;        ///< (largest - smallest) / median of that ratio over the runs
  double psnr = 0;          ///< over all views, values not rounded to 8 bits, dB
  double max_error = 0;     ///< largest difference of a colour, in [0, 1]
  double dropped_mean = 0;  ///< mean over all pixels of the missing opacity: max(0, reference - variant)
  double dropped_max = 0;   ///< the largest of them
  double grid_bytes = 0;    ///< size of the occupancy grid in a file, one bit per cell
  bool front = false;       ///< no other variant beats it in time, psnr and grid_bytes, see pareto_front()
};

/// What the field's grid omits, from some pixels of every view: compares the reference without the grid with
/// the reference with it.
struct OccupancyCost {
  Index pixels = 0;         ///< examined, over all views
  double psnr = 0;          ///< dB; infinity if nothing is omitted
  double max_error = 0;     ///< largest difference of a colour
  double dropped_mean = 0;  ///< mean missing opacity
  double dropped_max = 0;   ///< the largest of them
};

/// Options of run_field_bench().
struct FieldBenchOptions {
  int runs = 5;                  ///< per variant; the median counts; at least 1
  Index samples = 1024;          ///< of the reference on every ray, at least 1
  Index unmasked_pixels = 4096;  ///< per view, drawn at random, for OccupancyCost, at least 1
  std::uint64_t seed = 1;        ///< seed of their choice
  bool quick = false;            ///< the default and one variant per knob: for tests
  ParetoMargin margin{};         ///< differences that count as equal
};

/// Result of run_field_bench(); the first row is the default.
struct FieldBench {
  std::vector<FieldRow> rows;    ///< the default, then the others in the order of field_variants()
  OccupancyCost occupancy;       ///< of the field's own grid
  double reference_seconds = 0;  ///< per view
};

/// Renders the views with every variant in turn and compares them with a FieldReference.
/// @param progress  called with the next task and the fraction done; may throw to stop
/// @throws ValueError if there are no cameras or an option is out of range
FieldBench run_field_bench(const nerf::RadianceField& field, const std::vector<nerf::Camera>& cameras,
                           const FieldBenchOptions& options = {},
                           const std::function<void(const std::string&, double)>& progress = {});

/// Explains the default's position from the figures: what is faster and what is more exact, and at what cost.
/// @param margin  with which the front was marked   @throws ValueError if there are no rows
std::string judgement(const FieldBench& bench, const ParetoMargin& margin = {});

}  // namespace fieldmark::bench
