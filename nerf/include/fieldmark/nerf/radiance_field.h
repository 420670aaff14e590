#pragma once
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/field.h>
#include <fieldmark/nerf/occupancy_grid.h>
#include <fieldmark/nerf/space.h>

#include <filesystem>

namespace fieldmark::nerf {

/// Maximum number of rays along each side of a pixel.
inline constexpr Index kMostSupersampling = 8;

/// Sizes of a RadianceField.
struct RadianceFieldOptions {
  FieldOptions field{};    ///< of the networks and the encoding
  Index occupancy = 128;   ///< cells per axis of the occupancy grid, see OccupancyGrid
  float step = 1.f / 420;  ///< spacing of samples along a ray, in diagonals of the cube, in (0, 1]
  std::uint64_t seed = 0;  ///< of the initial parameters
  RayPoints points{};      ///< samples along a ray of an mlp field
  /// Rays along each side of a pixel, 1, 2, 4 or 8: the default of a Renderer, and of a Trainer after
  /// TrainOptions::supersample_after steps.
  Index supersampling = 1;
};

/// A field with everything needed to render it: parameters, space, occupancy, the span of its training
/// cameras and its background. A FIELD file holds one.
class RadianceField {
 public:
  /// Makes a field with initial parameters and all cells occupied. @throws ValueError if an option is out of
  /// range
  explicit RadianceField(const RadianceFieldOptions& options);

  /// Spacing of samples, cube sides.
  float step() const { return options_.step * 1.7320508f; }

  /// Writes a FIELD. Tensors: "density/*", "colour/*", "density/occupancy" (one bit per cell); for a hash
  /// field "hash/density_features" and "hash/colour_features" [kept rows, F]; for an mlp field
  /// "coarse/density/*" and "coarse/colour/*". Table rows that no occupied cell reads are omitted and load as
  /// zeros; "hash/rows" (one bit per row) then marks the rows kept. @throws IoError
  void save(const std::filesystem::path& path) const;
  /// @throws IoError if the file is missing, foreign, of another kind, or a tensor does not match its
  /// configuration
  static RadianceField load(const std::filesystem::path& path);
  /// Adds the tensors of save() to a larger file (an OWNER, a checkpoint), with `prefix` before their names.
  void store(SafetensorsFile& file, const std::string& prefix) const;
  /// Reads the tensors of store(). @throws IoError if one is missing or does not match
  void restore(const SafetensorsFile& file, const std::string& prefix);
  /// Returns options, bounds, cameras and background as JSON text.
  std::string configuration() const;
  /// Makes the field of a configuration(), with initial parameters.
  /// @param place  named in errors   @throws IoError if the text is not a configuration
  static RadianceField from_configuration(std::string_view text, std::string_view place);

  /// The options given to the constructor.
  const RadianceFieldOptions& options() const { return options_; }

  ParamStore<float> params;                   ///< of the networks and the table
  Field<float> field;                         ///< reads the parameters
  std::optional<Field<float>> coarse;         ///< mlp only: finds where to evaluate `field`
  OccupancyGrid grid;                         ///< the occupied cells of the cube
  Space space;                                ///< the map from the world to the cube
  CameraSpan cameras;                         ///< of the training cameras
  Background background = Background::white;  ///< behind its images

 private:
  RadianceFieldOptions options_;
};

}  // namespace fieldmark::nerf
