#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/camera.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// What is behind the scene where an image is not opaque.
enum class Background { white, black };

/// How a folder holds a data set.
enum class Layout {
  blender,     ///< transforms_{train,val,test}.json, one for each split: Mildenhall et al. 2020 (NeRF)
  transforms,  ///< one transforms.json, of instant-ngp or nerfstudio
  llff,        ///< poses_bounds.npy: Mildenhall et al. 2019 (LLFF)
  colmap       ///< a sparse model of COLMAP, text or binary
};
/// "blender", "transforms", "llff" or "colmap".
std::string_view layout_name(Layout layout);

/// From where to where a view shows something, along its axis.
struct DepthRange {
  double near = 0;  ///< length, > 0
  double far = 0;   ///< length, > near
};

/// A photograph and the camera that took it.
struct View {
  Camera camera;                      ///< of the size of the image
  Tensor<float> rgba;                 ///< [height, width, 4] in [0, 1], straight (not premultiplied) alpha
  std::string name;                   ///< as in the data set, without folder and extension: "r_12"
  std::optional<DepthRange> depth{};  ///< where the data set knows it (layouts llff and colmap)
};

/// One split of a data set in memory.
struct Dataset {
  std::string name;                           ///< of the folder: "lego"
  std::string split;                          ///< "train", "val" or "test"
  Background background = Background::white;  ///< in front of which its views are shown
  std::vector<View> views;                    ///< at least one; all of one size
  Layout layout = Layout::blender;            ///< how the folder holds it
  /// Whether it is of layout llff and every camera looks within 60 degrees of their mean axis, -z.
  bool forward_facing = false;
  std::optional<double> aabb_scale{};  ///< side of the scene's cube in instant-ngp's units, where stated
  std::vector<Vec3> points{};          ///< points of the scene's surface, where the layout has them (colmap)
  std::vector<std::string> notes{};  ///< for people: what was left out, cut off or held out, a sentence each
};

/// What load_dataset() reads, and at what size.
struct DatasetOptions {
  std::string split = "train";  ///< "train", "val" or "test"
  /// Pixels of the longer side after an area filter on premultiplied colour; 0: as it is. Where distorted
  /// images lose their rims, it is the size before that.
  Index size = 0;
  /// Of the Dataset that is made; none: white for the layout blender, black for photographs.
  std::optional<Background> background{};
};

/// Reads one split of a data set. The layout is the first whose file the folder has: transforms_train.json
/// (or _val, _test), transforms.json, poses_bounds.npy, cameras.bin or cameras.txt (in sparse/0,
/// sparse or the folder itself). All but blender hold out every 8th image (0, 8, 16,
/// ... of the names sorted) as val and test, and have the others in train. Images without alpha are taken
/// as opaque.
///
/// transforms: see parse_transforms(). Frames without an image are left out, with a note. Distorted images
/// are made into those of a pinhole (undistorted_image()), all cut to the part that covered_part() has for
/// every lens of the file; what is outside is neither trained on nor measured.
///
/// llff: see parse_poses_bounds(); poses are recentred and rescaled by recentre_llff(). Images are those of
/// the folder images or images_N whose longer side is the smallest that reaches `size` (else the largest),
/// sorted by name.
///
/// colmap: see parse_colmap_cameras(). World axes are COLMAP's. Images as for llff, lenses and missing
/// images as for transforms; points3D is read where it is there.
/// @throws ValueError  if an option is outside its range
/// @throws IoError     naming file and place: folder, JSON or an image missing, unreadable or malformed, no
///                     views, images of differing sizes, a distortion that has no inverse, none of the
///                     files above
Dataset load_dataset(const std::filesystem::path& folder, const DatasetOptions& options = {});

/// The layout that load_dataset() finds. @throws IoError if there is no folder or none of the layouts' files
Layout find_layout(const std::filesystem::path& folder);
/// Whether the data set has this split: the layout blender has a file for each, the others hold out views.
/// @throws IoError as find_layout()
bool has_split(const std::filesystem::path& folder, std::string_view split);

/// A view in front of a background: rgb * alpha + background * (1 - alpha), [height, width, 3].
Tensor<float> composited(const View& view, Background background);

/// 1 for white, 0 for black.
float background_value(Background background);

}  // namespace fieldmark::nerf
