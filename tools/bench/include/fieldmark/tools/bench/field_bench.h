#pragma once
#include <fieldmark/imaging/pareto.h>
#include <fieldmark/tools/bench/field_variants.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// A variant beside the reference.
struct FieldRow {
  FieldVariant variant;  ///< how it was rendered
  /// Seconds a view, mean over the views. The time of a view is its ratio to the default timed right before
  /// it, median over the runs, times the default's median.
  double seconds = 0;
  double spread = 0;        ///< (largest - smallest) / median of that ratio over the runs
  double psnr = 0;          ///< of all views together, numbers not rounded to 8 bits, dB
  double max_error = 0;     ///< largest difference of a colour, in [0, 1]
  double dropped_mean = 0;  ///< mean over all pixels of the opacity that is missing: max(0, reference - it)
  double dropped_max = 0;   ///< the largest of them
  double grid_bytes = 0;    ///< of the occupancy grid, one bit a cell, in a file
  bool front = false;       ///< no other one beats it in time, psnr and grid_bytes, see pareto_front()
};

/// What the field's grid leaves out, of some pixels of every view: the reference without it against that
/// with.
struct OccupancyCost {
  Index pixels = 0;         ///< looked at, over all views
  double psnr = 0;          ///< dB; infinity if it leaves out nothing
  double max_error = 0;     ///< largest difference of a colour
  double dropped_mean = 0;  ///< mean opacity that is missing
  double dropped_max = 0;   ///< the largest of them
};

/// Settings of run_field_bench().
struct FieldBenchOptions {
  int runs = 5;                  ///< of each variant, whose median counts, at least 1
  Index samples = 1024;          ///< of the reference on every ray, at least 1
  Index unmasked_pixels = 4096;  ///< of a view, drawn at random, for OccupancyCost, at least 1
  std::uint64_t seed = 1;        ///< of their choice
  bool quick = false;            ///< the default and one variant of each knob: for tests
  ParetoMargin margin{};         ///< what counts as equal
};

/// What run_field_bench() measured; the first row is the default.
struct FieldBench {
  std::vector<FieldRow> rows;    ///< the default, then the others as field_variants() has them
  OccupancyCost occupancy;       ///< of the field's own grid
  double reference_seconds = 0;  ///< of a view
};

/// Renders views in every variant by turns, and compares them with a FieldReference.
/// @param progress  called with what is done next and the part that is done; may throw to stop
/// @throws ValueError if there are no cameras or an option is out of range
FieldBench run_field_bench(const nerf::RadianceField& field, const std::vector<nerf::Camera>& cameras,
                           const FieldBenchOptions& options = {},
                           const std::function<void(const std::string&, double)>& progress = {});

/// Why the default stands where it does, from the figures: what is faster and what is more exact, and at what
/// price. @param margin  as the front was marked with   @throws ValueError if there are no rows
std::string judgement(const FieldBench& bench, const ParetoMargin& margin = {});

}  // namespace fieldmark::bench
