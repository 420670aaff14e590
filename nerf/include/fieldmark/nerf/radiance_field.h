#pragma once
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/field.h>
#include <fieldmark/nerf/occupancy_grid.h>
#include <fieldmark/nerf/visual_hull.h>

#include <filesystem>

namespace fieldmark::nerf {

struct RadianceFieldOptions {
  FieldOptions field{};
  Index occupancy = 128;   ///< cells per axis of the occupancy grid, see OccupancyGrid
  float step = 1.f / 420;  ///< spacing of samples along a ray, in diagonals of the cube
  std::uint64_t seed = 0;  ///< of the initial numbers
};

/// A field with all that is needed to render it: parameters, the cube it fills, which cells are occupied, the
/// span of the cameras it was trained from and its background. This is what a FIELD file holds.
class RadianceField {
 public:
  explicit RadianceField(const RadianceFieldOptions& options);

  /// Spacing of samples, cube sides.
  float step() const { return options_.step * 1.7320508f; }
  /// World ray to cube coordinates: the origin moves, the unit direction stays, lengths count in cube sides.
  void to_cube(const float* origin, float* cube_origin) const;

  /// Writes a FIELD. Tensors: "density/*", "colour/*", "hash/density_features" and "hash/colour_features"
  /// [rows, F] and "density/occupancy" (one bit a cell). @throws IoError
  void save(const std::filesystem::path& path) const;
  /// @throws IoError if the file is missing, foreign, of another kind, or its tensors do not fit its
  /// configuration
  static RadianceField load(const std::filesystem::path& path);
  /// The same inside a larger file (an OWNER, a checkpoint), tensor names after `prefix`.
  void store(SafetensorsFile& file, const std::string& prefix) const;
  void restore(const SafetensorsFile& file, const std::string& prefix);
  /// Options, bounds, cameras and background as JSON text, and the field they describe with its initial
  /// numbers.
  std::string configuration() const;
  static RadianceField from_configuration(std::string_view json, std::string_view place);

  const RadianceFieldOptions& options() const { return options_; }

  ParamStore<float> params;
  Field<float> field;
  OccupancyGrid grid;
  Bounds bounds;
  CameraSpan cameras;
  Background background = Background::white;

 private:
  RadianceFieldOptions options_;
};

}  // namespace fieldmark::nerf
