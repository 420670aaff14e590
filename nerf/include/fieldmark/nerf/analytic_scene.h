#pragma once
#include <fieldmark/nerf/dataset.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace fieldmark::nerf {

/// The built-in scenes.
enum class SceneKind {
  objects,  ///< textured solids of every kind on a round slab, with soft shadows
  sphere,   ///< one sphere of one colour, shaded
  wires,    ///< a stand of thin rods, rings and hanging cables
  plain,    ///< large solids of one colour each
  glossy    ///< solids that mirror the sun and the sky, so that their colours depend on the view
};
/// All built-in scenes.
constexpr SceneKind kSceneKinds[] = {SceneKind::objects, SceneKind::sphere, SceneKind::wires,
                                     SceneKind::plain, SceneKind::glossy};

/// Returns "objects", "sphere", "wires", "plain" or "glossy".
const char* scene_kind_name(SceneKind kind);
/// Inverts scene_kind_name(). @throws ValueError for another name
SceneKind parse_scene_kind(std::string_view name);

/// A built-in scene within 1.2 of the origin, and cameras like those of the Blender scenes: on the upper half
/// of a sphere of radius 4.0311, looking at the origin, camera_angle_x 0.6911.
struct SceneOptions {
  SceneKind kind = SceneKind::objects;  ///< which scene
  Index size = 200;                     ///< pixels of both sides, 1 to 8192
  Index views = 100;  ///< of the training split, 1 to 100000; val has a tenth, test a quarter, at least 1
  std::uint64_t seed = 0;  ///< of placement, colours and cameras
};

/// Ray-traces one view with 4 x 4 samples per pixel; alpha is the covered share of a pixel. Surfaces are
/// diffuse under a sky and a soft sun, both occluded by spheres inside the solids (sun: the angle to the
/// sphere; sky: (r / d)^2), so a point has the same colour from all sides, except in the scene glossy.
/// @return  [height, width, 4] straight alpha, rounded to 8 bits   @throws ValueError if an option is out of
/// range
Tensor<float> render_scene(const SceneOptions& options, const Camera& camera);

/// Maps a point of an image, in pixels from its upper left corner, to the point of the plane at distance 1 in
/// front of the camera that is seen there: x right, y down. Both coordinates must be finite, so nothing is
/// seen at 90 degrees from the axis or beyond.
using ImageToPlane = std::function<std::array<double, 2>(double x, double y)>;
/// Ray-traces one view through a lens. @param camera  pose and size; the lens replaces the rest
/// @param to_plane  called from several threads, for points of the image, its edges included
/// @return  as above   @throws ValueError if an option is out of range
Tensor<float> render_scene(const SceneOptions& options, const Camera& camera, const ImageToPlane& to_plane);

/// Makes one split in memory: the images and cameras of write_scene().
/// @throws ValueError  if an option is out of range or split is not "train", "val" or "test"
Dataset make_scene(const SceneOptions& options, const std::string& split = "train",
                   Background background = Background::white);

/// Called on the calling thread with the images done and their total; may throw to stop.
using SceneProgress = std::function<void(Index done, Index total)>;

/// Writes all splits as a data set for load_dataset(): folders train, val and test of RGBA PNG files, and,
/// when their images are complete, transforms_{train,val,test}.json. Equal options give equal bytes.
/// @throws ValueError  if an option is out of range   @throws IoError if folder or files cannot be written
void write_scene(const SceneOptions& options, const std::filesystem::path& folder,
                 const SceneProgress& progress = {});

}  // namespace fieldmark::nerf
