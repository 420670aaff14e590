#pragma once
#include <fieldmark/nerf/camera.h>
#include "lens.h"

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// The contents of a transforms_*.json of the Blender layout, or of a transforms.json of instant-ngp or
/// nerfstudio.
struct Transforms {
  /// An image and its camera.
  struct Frame {
    std::string file_path;    ///< relative to the folder of the JSON, with or without extension
    Pose pose{};              ///< from the camera to the world, OpenGL axes
    Intrinsics intrinsics{};  ///< those of the whole file, each replaced by the frame's own
    std::string mask_path{};  ///< relative to the folder of the JSON; empty: no mask is named
  };
  double camera_angle_x = 0;  ///< of the whole file: horizontal field of view, radians, in (0, pi); 0: none
  std::vector<Frame> frames;  ///< at least one
  /// Names of train_filenames, val_filenames and test_filenames, in this order.
  std::array<std::vector<std::string>, 3> splits{};
  std::vector<std::string> notes{};  ///< human-readable: one sentence per repair and unused key
};

/// Reads the text of a transforms.json or transforms_*.json. Keys of the file, or of a frame, which take
/// precedence: camera_angle_x, camera_angle_y (radians), fl_x, fl_y, cx, cy, w, h (pixels), k1 to k6, p1, p2,
/// camera_model, is_fisheye (see Lens; k5 and k6 make it rational). Rotations that are off orthonormal by
/// 1e-5 to 1e-2 (largest entry of |R^T R - I|) are replaced by the nearest rotation; closer ones are kept.
/// Matrices of 3 rows have a fourth of 0 0 0 1; others are divided by its last number; a common scale is
/// divided out of the rotations; if all are reflections, the world is mirrored along x. Coordinates are
/// otherwise those of the file: instant-ngp's scaling by 0.33 about (0.5, 0.5, 0.5) is not applied. Other
/// keys are ignored, unknown ones with a note.
/// @param path  named in errors
/// @throws IoError  with line and byte where the text is not JSON; with the place
///                  (`frames[3].transform_matrix`), what was expected and what was found if it is: a key
///                  missing or of the wrong type, an angle outside (0, pi), a length or size that is not
///                  positive, a camera_model without a Lens, no frames, an empty file_path, a matrix that is
///                  not 4x4 or 3x4 finite numbers with a rotation, or some that are reflections
Transforms parse_transforms(std::string_view text, std::string_view path);

/// Returns text that parse_transforms() reads back to the same camera_angle_x, names and poses; the rest is
/// omitted.
std::string format_transforms(const Transforms& transforms);

}  // namespace fieldmark::nerf
