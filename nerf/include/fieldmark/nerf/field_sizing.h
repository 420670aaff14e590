#pragma once
#include <fieldmark/nerf/trainer.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// How a field's sizes are found.
struct SizingOptions {
  Index steps = 512;              ///< of each short training, >= 64
  Index samples_per_step = 8192;  ///< of each short training, see TrainOptions
  double worth = 0.35;            ///< dB that a table of four times the rows must gain, > 0
  /// dB that are enough in a short training: photographs give less, and the built-in sphere, which gives
  /// more, ends above 40 dB in a whole one (docs/results/sizing.md).
  double enough = 34;
  int most_log2_table = 18;  ///< largest table that is tried, 9 to 24
  std::uint64_t seed = 0;    ///< of fields and trainings
};

/// One short training.
struct SizingTrial {
  std::string what;            ///< what it tries, for people: "table of 2^13"
  RadianceFieldOptions field;  ///< that was trained
  Index parameters = 0;        ///< numbers of that field
  double samples = 0;          ///< that passed through its networks
  double psnr = 0;             ///< see Trainer::train_psnr(), at its end
  bool kept = false;           ///< whether what it tried was taken
};

/// What a scene needs.
struct FieldSizing {
  RadianceFieldOptions field;       ///< as sized
  double pixels = 0;                ///< cells per axis of the cube at which a cell looks as large as a pixel
  std::vector<SizingTrial> trials;  ///< in the order they were made
  bool compared = true;             ///< false: ended before tables were, so that field is as it was
};

/// Cells per axis of the unit cube at which a cell, at the distance of the cube's middle (contracted: of the
/// inner cube's face; ndc: anywhere), looks as large as a pixel: finer ones cannot be told apart. The median
/// over views.
double pixel_resolution(const Dataset& data, const Space& space);

/// Sizes a hash field from its scene, by the photographs and by short trainings on the same rays:
///   - the finest level has 1.5 pixel_resolution() cells per axis, the coarsest 16, each about 1.75 times the
///   last;
///   - the occupancy grid has a quarter of the finest level's cells per axis: 32, 64 or 128;
///   - the table grows fourfold from 2^9 as long as that gains `worth` dB and `enough` is not reached;
///   - the viewing direction is taken away where that gains a sixth of `worth` or leaves `enough`: it is few
///     numbers, and short trainings see little of what it is for;
///   - half of the networks' width and then the finest levels, one by one, are taken away where that loses
///     less than a sixth and half of `worth`, or leaves `enough`.
/// Space, step and seed are those of `start`. Where a scene has no bounds, a training of `start` finds out
/// first what is empty, and the others leave that out.
/// @param progress  called before each training and on its way, with how many are done and how many there may
///                  be; false ends the sizing: with `start` itself as long as tables are compared, later with
///                  what is known. May be empty
/// @throws ValueError if an option is out of range or start is not of kind hash
FieldSizing size_field(const Dataset& data, const RadianceFieldOptions& start, const SizingOptions& options,
                       const std::function<bool(Index done, Index total)>& progress = {});

}  // namespace fieldmark::nerf
