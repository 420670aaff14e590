#pragma once
#include <fieldmark/nerf/dataset.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// The region of a field's training cameras, for drawing new cameras without the data set: directions and
/// distances around a centre, intrinsics, and the extent of the scene.
struct CameraSpan {
  Vec3 centre{};                              ///< the point nearest to all viewing axes, length
  Vec3 up{0, 0, 1};                           ///< unit
  double half_size = 1;                       ///< of the cube about centre that holds the scene, length, > 0
  std::vector<Vec3> directions;               ///< [N] unit, from centre to each training camera; at least one
  std::vector<double> distances;              ///< [N] from centre to each training camera, length, > 0
  double fx = 1;                              ///< horizontal focal length, in image widths, > 0
  double fy = 1;                              ///< vertical focal length, in image widths, > 0
  double cx = 0.5;                            ///< principal point from the left edge, in image widths
  double cy = 0.5;                            ///< principal point from the upper edge, in image widths
  Index width = 1;                            ///< of the training images, pixels
  Index height = 1;                           ///< of the training images, pixels
  Background background = Background::white;  ///< of the data set
  bool forward_facing = false;                ///< true if all cameras look one way, from a patch of a plane
};

/// Computes the span of cameras around a scene. `up` is the direction most nearly perpendicular to the
/// cameras' x axes; half_size is 1.05 times the largest distance * tan(horizontal field of view / 2), which
/// fills an image's width. Intrinsics and size are those of the first camera.
/// @throws ValueError  if there are no cameras, or all are at the point they look at
CameraSpan camera_span(std::span<const Camera> cameras, Background background);
/// Computes the span of a data set's views. Forward-facing: the centre lies in front of the mean camera at
/// the depth whose inverse is 1/4 of the least near bound's inverse plus 3/4 of the greatest far bound's (the
/// focus of the render paths of Mildenhall et al. 2019, LLFF).
CameraSpan camera_span(const Dataset& dataset);

/// The camera sets of `--cameras`. Look-at points of novel, closer and farther are uniform in a ball about
/// the centre whose radius is 5% of the scene's size; the other sets look at the centre. Forward-facing, eyes
/// lie in the box of the training cameras' positions, along the axes of the mean camera.
enum class CameraSet {
  novel,    ///< a training distance times 0.8 to 1.5, in a direction of the spherical triangle of a training
            ///< direction and two of its six nearest neighbours; forward-facing: in the box
  ring,     ///< azimuth uniform, elevation 30 degrees, distance 4.0311
  sphere,   ///< direction uniform, a training distance
  test,     ///< the data set's test views: not drawn
  closer,   ///< as novel, distances times 0.5 to 0.8; forward-facing: 0.8 to 1 of the way from the centre
  farther,  ///< as novel, distances times 1.5 to 3; forward-facing: 1 to 1.25 of the way from the centre
  extrapolated  ///< as sphere, more than 30 degrees from every training direction (the first of 256
                ///< directions that is, else the farthest); forward-facing: around the box, in one of twice
                ///< its sides
};
/// Returns the names that parse_camera_set() accepts, in the order of a table.
std::vector<std::string> camera_set_names();
/// @throws ValueError  if name is not one of camera_set_names()
CameraSet parse_camera_set(std::string_view name);

/// Draws cameras of a set, with the intrinsics of the span. Camera i depends only on span, kind, size, seed
/// and i.
/// @param count  >= 0   @param size  pixels of the longer side; 0: as in training
/// @throws ValueError  if kind is test, count or size is negative, or span has no directions
std::vector<Camera> make_cameras(const CameraSpan& span, CameraSet kind, Index count, Index size,
                                 std::uint64_t seed);

/// Returns a span as JSON text for a file's metadata; it parses back to the same values.
std::string format_camera_span(const CameraSpan& span);
/// @param where  named in errors   @throws IoError naming the place, what was expected and what was found
CameraSpan parse_camera_span(std::string_view text, std::string_view where);

}  // namespace fieldmark::nerf
