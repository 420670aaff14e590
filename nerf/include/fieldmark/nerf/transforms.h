#pragma once
#include <fieldmark/nerf/camera.h>

#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// The contents of a transforms_*.json.
struct Transforms {
  /// One picture and where it was taken from.
  struct Frame {
    std::string file_path;  ///< relative to the folder of the JSON, with or without ".png"
    Pose pose{};            ///< from the camera to the world, OpenGL axes
  };
  double camera_angle_x = 0;  ///< horizontal field of view, radians, in (0, pi)
  std::vector<Frame> frames;  ///< at least one
};

/// Reads the text of a transforms_*.json of the Blender layout; other keys than those of Transforms are
/// ignored.
/// @param path  named in errors
/// @throws IoError  with line and byte where the text is not JSON; with the place
/// (`frames[3].transform_matrix`), what
///                  was expected and what was found where it is: a key missing or of the wrong type,
///                  camera_angle_x outside (0, pi), no frames, an empty file_path, a matrix that is not 4x4
///                  finite numbers, whose upper left 3x3 is not a rotation to within 1e-3 or whose last row
///                  is not 0 0 0 1
Transforms parse_transforms(std::string_view text, std::string_view path);

/// The text that parse_transforms() reads back to the same numbers.
std::string format_transforms(const Transforms& transforms);

}  // namespace fieldmark::nerf
