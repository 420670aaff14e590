#pragma once
#include <fieldmark/nerf/dataset.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// What new cameras for a field can be drawn from without its data set: where the training cameras stood
/// around a centre, their intrinsics, and the bounds of the scene.
struct CameraSpan {
  Vec3 centre{};                              ///< the point nearest to all viewing axes, length
  Vec3 up{0, 0, 1};                           ///< unit
  double half_size = 1;                       ///< of the cube about centre that holds the scene, length, > 0
  std::vector<Vec3> directions;               ///< [N] unit, from centre to each training camera; at least one
  std::vector<double> distances;              ///< [N] from centre to each training camera, length, > 0
  double fx = 1;                              ///< focal length across, in widths of the image, > 0
  double fy = 1;                              ///< focal length down, in widths of the image, > 0
  double cx = 0.5;                            ///< principal point from the left edge, in widths of the image
  double cy = 0.5;                            ///< principal point from the upper edge, in widths of the image
  Index width = 1;                            ///< of the training images, pixels
  Index height = 1;                           ///< of the training images, pixels
  Background background = Background::white;  ///< of the data set
  bool forward_facing = false;                ///< whether all cameras look one way, from a patch of a plane
};

/// The span of cameras that look at a scene from around it. `up` is the direction most at right angles to the
/// cameras' x axes; half_size is 1.05 times the largest distance * tan(horizontal field of view / 2): what
/// fills an image across. Intrinsics and size are those of the first camera.
/// @throws ValueError  if there are no cameras, or all stand at the point they look at
CameraSpan camera_span(std::span<const Camera> cameras, Background background);
/// Of a data set's views. Forward-facing: the centre lies in front of the mean camera at the depth whose
/// inverse is 1/4 of the least near bound's and 3/4 of the greatest far bound's (the focus of the render
/// paths of Mildenhall et al. 2019, LLFF).
CameraSpan camera_span(const Dataset& dataset);

/// The sets of `--cameras`.
enum class CameraSet {
  novel,  ///< inside the training cameras' directions, 0.8 to 1.5 of their distances, look-at within 5% of
          ///< the scene's size; forward-facing: inside the box of their positions
  ring,    ///< azimuth uniform, elevation 30 degrees, distance 4.0311
  sphere,  ///< every direction alike, at distances of training cameras
  test,    ///< the data set's test views: read them from there
  closer,  ///< as novel, at 0.5 to 0.8 of the training cameras' distances; forward-facing: 0.8 to 1 of the
           ///< way from the centre
  farther,  ///< as novel, at 1.5 to 3 of the distances; forward-facing: 1 to 1.25 of the way from the centre
  extrapolated  ///< as sphere, in directions more than 30 degrees from every training camera's;
                ///< forward-facing: around the box, in one of twice its sides
};
/// The names of parse_camera_set(), in the order of a table.
std::vector<std::string> camera_set_names();
/// @throws ValueError  if name is not one of camera_set_names()
CameraSet parse_camera_set(std::string_view name);

/// Cameras of a set, all with the intrinsics of the span. Camera i depends on span, kind, size, seed and i
/// only. near: the direction is a random point of the spherical triangle of a random training direction and
/// two of its six nearest neighbours; the look-at point is uniform in a ball of radius 0.05 * 2 * half_size
/// about the centre. near, forward-facing: the position is uniform in the box of the training cameras', along
/// the axes of the mean camera; look-at as before. unseen: of 256 directions, the first that is far enough
/// from the training cameras', or the farthest where none is.
/// @param count  >= 0   @param size  pixels of the longer side; 0: as in training
/// @throws ValueError  if kind is test, count or size is negative, or span has no directions
std::vector<Camera> make_cameras(const CameraSpan& span, CameraSet kind, Index count, Index size,
                                 std::uint64_t seed);

/// JSON text of a span, for a file's metadata; reads back to the same numbers.
std::string format_camera_span(const CameraSpan& span);
/// @param where  named in errors   @throws IoError naming the place, what was expected and what was found
CameraSpan parse_camera_span(std::string_view text, std::string_view where);

}  // namespace fieldmark::nerf
