#pragma once
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/field.h>
#include <fieldmark/nerf/hierarchical_sampler.h>
#include <fieldmark/nerf/occupancy_grid.h>
#include <fieldmark/nerf/space.h>

#include <filesystem>

namespace fieldmark::nerf {

/// Rays along each side of a pixel, at most.
inline constexpr Index kMostSupersampling = 8;

/// Sizes of a RadianceField.
struct RadianceFieldOptions {
  FieldOptions field{};    ///< of the networks and the encoding
  Index occupancy = 128;   ///< cells per axis of the occupancy grid, see OccupancyGrid
  float step = 1.f / 420;  ///< spacing of samples along a ray, in diagonals of the cube
  std::uint64_t seed = 0;  ///< of the initial numbers
  RayPoints points{};      ///< where an mlp field is looked at along a ray
  /// Rays along each side of a pixel that its images are made of, 1, 2, 4 or 8: what a Renderer sends
  /// unless told otherwise, and a Trainer in the later part of a run, see TrainOptions::supersample_after.
  Index supersampling = 1;
};

/// A field with all that is needed to render it: parameters, the cube it fills, which cells are occupied, the
/// span of the cameras it was trained from and its background. This is what a FIELD file holds.
class RadianceField {
 public:
  /// A field with initial numbers, all cells occupied. @throws ValueError if an option is out of range
  explicit RadianceField(const RadianceFieldOptions& options);

  /// Spacing of samples, cube sides.
  float step() const { return options_.step * 1.7320508f; }

  /// Writes a FIELD. Tensors: "density/*", "colour/*", "density/occupancy" (one bit a cell), and of a hash
  /// field "hash/density_features" and "hash/colour_features" [kept rows, F], of an mlp field
  /// "coarse/density/*" and "coarse/colour/*". Rows of the table that no occupied cell reads are left out,
  /// see rows_in_use(), and come back as zeros; "hash/rows" (one bit a row) then says which are kept. @throws
  /// IoError
  void save(const std::filesystem::path& path) const;
  /// @throws IoError if the file is missing, foreign, of another kind, or its tensors do not fit its
  /// configuration
  static RadianceField load(const std::filesystem::path& path);
  /// The same inside a larger file (an OWNER, a checkpoint), tensor names after `prefix`.
  void store(SafetensorsFile& file, const std::string& prefix) const;
  /// Reads what store() wrote. @throws IoError if a tensor is missing or does not fit
  void restore(const SafetensorsFile& file, const std::string& prefix);
  /// Options, bounds, cameras and background as JSON text, and the field they describe with its initial
  /// numbers.
  std::string configuration() const;
  /// @param place  named in errors   @throws IoError if the text is not what configuration() writes
  static RadianceField from_configuration(std::string_view text, std::string_view place);

  /// As constructed.
  const RadianceFieldOptions& options() const { return options_; }

  ParamStore<float> params;                   ///< all numbers of the networks and the table
  Field<float> field;                         ///< how they are read
  std::optional<Field<float>> coarse;         ///< of an mlp field: finds where the other is to be looked at
  OccupancyGrid grid;                         ///< which cells of the cube are not empty
  Space space;                                ///< how the world is laid into the cube
  CameraSpan cameras;                         ///< where the training cameras stood
  Background background = Background::white;  ///< what its images are composited over

 private:
  RadianceFieldOptions options_;
};

}  // namespace fieldmark::nerf
