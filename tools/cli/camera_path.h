#pragma once
#include <fieldmark/nerf/camera_set.h>

#include <filesystem>
#include <vector>

namespace fieldmark::cli {

/// Returns cameras along a closed path around a scene, for videos. They look at the span's centre from the
/// median distance and mean elevation of the training cameras, those above 75 degrees counted as
/// 75. The path is a full circle; where the training
/// cameras leave out more than 90 degrees of it, it swings through nine tenths of what they cover. For
/// forward-facing captures it is an ellipse through the middle half of the training cameras' positions.
/// @param count  at least 1   @param size  pixels of the longer side; 0: as in training
std::vector<nerf::Camera> orbit(const nerf::CameraSpan& span, Index count, Index size);

/// Cameras around a scene, row by row from the highest to the lowest.
struct CameraGrid {
  Index rows = 0;                     ///< at least 1
  Index columns = 0;                  ///< at least 1
  bool closed = true;                 ///< true if the last column is beside the first
  std::vector<nerf::Camera> cameras;  ///< [rows, columns]
};

/// Returns cameras like those of orbit(), at all heights of the training cameras, but at most 75 degrees up
/// or down.
CameraGrid camera_grid(const nerf::CameraSpan& span, Index rows, Index columns, Index size);

/// Reads cameras from a JSON file with the keys of transforms.json: `frames`, a list of objects whose
/// `transform_matrix` has 3 or 4 rows of 4 numbers, camera to world, OpenGL axes, in the coordinates of the
/// field. The file or a frame may state `w`, `h`, `camera_angle_x` (radians), `fl_x`, `fl_y`, `cx` and `cy`
/// (pixels); what is missing is the span's. Other keys, lens distortion among them, are ignored.
/// @param size  pixels of the longer side; 0: as the file states
/// @throws IoError naming file and place, what was expected and what was found
std::vector<nerf::Camera> read_camera_path(const std::filesystem::path& path, const nerf::CameraSpan& span,
                                           Index size);

}  // namespace fieldmark::cli
