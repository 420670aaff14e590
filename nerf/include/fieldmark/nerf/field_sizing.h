#pragma once
#include <fieldmark/nerf/trainer.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// Returns the field with the largest table whose file has at most max_bytes; none if no field is that small.
std::optional<RadianceFieldOptions> fit_field(RadianceFieldOptions field, double max_bytes);

/// Budget and criteria of size_field().
struct SizingOptions {
  Index steps = 512;              ///< of each short training, >= 64
  Index samples_per_step = 8192;  ///< of each short training, see TrainOptions
  double worth = 0.35;            ///< dB that a table of four times the rows must gain, > 0
  double enough = 34;             ///< dB of a short training beyond which nothing larger is tried
  int most_log2_table = 18;       ///< largest table to try, 9 to 24
  std::uint64_t seed = 0;         ///< of fields and trainings
};

/// One short training.
struct SizingTrial {
  std::string what;            ///< the change that it tries, human-readable: "table of 2^13"
  RadianceFieldOptions field;  ///< with the change
  Index parameters = 0;        ///< of that field
  double samples = 0;          ///< samples that passed through its networks
  double psnr = 0;             ///< see Trainer::train_psnr(), at its end
  bool kept = false;           ///< true if the change was kept
};

/// The result of size_field().
struct FieldSizing {
  RadianceFieldOptions field;       ///< with the chosen sizes
  double pixels = 0;                ///< see pixel_resolution()
  std::vector<SizingTrial> trials;  ///< in order
  bool compared = true;             ///< false: stopped before tables were compared; `field` is then unchanged
};

/// Returns the number of cells per axis of the unit cube at which a cell looks as large as a pixel, at the
/// distance of the cube's centre (contracted: of the inner cube's face; ndc: anywhere): the median over
/// views.
double pixel_resolution(const Dataset& data, const Space& space);

/// Sizes a hash field for its scene, from the cameras and from short trainings on the same rays:
///   - the finest level has 1.5 pixel_resolution() cells per axis, the coarsest 16, growing by about 1.75 a
///   level;
///   - the occupancy grid has a quarter of the finest level's cells per axis: 32, 64 or 128;
///   - the table grows fourfold from 2^9 while that gains `worth` dB and `enough` is not reached;
///   - the viewing direction is dropped if that gains a sixth of `worth` or `enough` is still reached;
///   - half of the networks' width with half of the geometry features, then the finest levels one by one,
///     are dropped if that loses at most a sixth and half of `worth`, respectively, or `enough` is still
///     reached.
/// Space, step and seed are those of `start`. For an unbounded scene, a training of `start` first finds the
/// empty cells, which the other trainings skip.
/// @param progress  called before and during each training; false stops, with `start` itself while tables are
///                  compared, later with the field so far. May be empty
/// @throws ValueError if an option is out of range or start is not of kind hash
FieldSizing size_field(const Dataset& data, const RadianceFieldOptions& start, const SizingOptions& options,
                       const std::function<bool(Index done, Index total)>& progress = {});

}  // namespace fieldmark::nerf
