#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/camera.h>
#include <fieldmark/nerf/scene_type.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// The colour behind transparent pixels.
enum class Background { white, black };

/// The file layout of a data set.
enum class Layout {
  blender,     ///< transforms_{train,val,test}.json, one for each split: Mildenhall et al. 2020 (NeRF)
  transforms,  ///< one transforms.json, of instant-ngp or nerfstudio
  llff,        ///< poses_bounds.npy: Mildenhall et al. 2019 (LLFF)
  colmap       ///< a sparse model of COLMAP, text or binary
};

/// The depths of a view's scene, along its axis.
struct DepthRange {
  double near = 0;  ///< length, > 0
  double far = 0;   ///< length, > near
};

/// A ground truth image and its camera.
struct View {
  Camera camera;                      ///< of the size of the image
  Tensor<float> rgba;                 ///< [height, width, 4] in [0, 1], straight (not premultiplied) alpha
  std::string name;                   ///< of the file, without folder and extension: "r_12"
  std::optional<DepthRange> depth{};  ///< of layout llff
  /// [height * width] 0 where a mask excludes the pixel or there is none, to be neither learnt nor counted,
  /// else 1; empty: all are valid
  std::vector<std::uint8_t> valid{};
  Index file_width = 0;   ///< of the image file, pixels; 0: there is none
  Index file_height = 0;  ///< of the image file, pixels; 0: there is none
  Index own_width = 0;    ///< pixels at the left that show the image, the others fill it up; 0: all
  Index own_height = 0;   ///< pixels at the top that show the image, the others fill it up; 0: all
};

/// One split of a data set in memory.
struct Dataset {
  std::string name;                           ///< of the folder: "lego"
  std::string split;                          ///< "train", "val" or "test"
  Background background = Background::white;  ///< behind its views
  std::vector<View> views;                    ///< at least one; all of one size
  Layout layout = Layout::blender;            ///< of the folder
  SceneType scene = SceneType::object;        ///< as its images and cameras tell, or as asked for
  std::string scene_reason{};                 ///< for people: why it is of this type
  /// Of scene plain: the colour behind the opaque pixels, some of which may show it. Its transparent pixels
  /// are background for certain.
  std::array<float, 3> plain_colour{};
  std::vector<std::string> notes{};  ///< for people: a sentence for each omission, crop and hold-out
};

/// Split, size, background and scene type for load_dataset().
struct DatasetOptions {
  std::string split = "train";  ///< "train", "val" or "test"
  /// Pixels of the longer side after an area filter on premultiplied colour, before distorted images lose
  /// their rims; 0: original size.
  Index size = 0;
  /// Behind the views; none: for scene object white in the layout blender, else black; for scene plain the
  /// one nearer to its colour; else black.
  std::optional<Background> background{};
  /// Type of the scene; none: as its images and cameras tell, see look_at_scene().
  std::optional<SceneType> scene{};
  /// Views to read, spread evenly over the split; 0: all.
  Index most_views = 0;
};

/// Reads one split of a data set. The layout is the first whose file the folder has: transforms_train.json
/// (or _val, _test), transforms.json, poses_bounds.npy, cameras.bin or cameras.txt (in sparse/0, sparse or
/// the folder itself). All layouts but blender hold out every 8th image (0, 8, 16, ... of the sorted names)
/// as val and test, and have the others in train. Images without alpha are opaque. Images are also found
/// under names with backslashes, in another case or with another extension, and those of transforms by the
/// end of an absolute path of another computer.
///
/// Masks: the file that a frame's mask_path names, where black excludes, or dynamic_mask_NAME.png beside the
/// image NAME, where black keeps; see View::valid.
/// transforms: see parse_transforms(). Where train_filenames, val_filenames or test_filenames list frames,
/// these are the splits: val and test stand in for one another, and train has what they leave. Frames without
/// an image are left out, with a note. Distorted images become those of a pinhole (undistorted_image()), cut
/// to the part that every lens of the file covers. llff: see parse_poses_bounds(); recentre_llff() recentres
/// and rescales the poses. Images are those of the folder images or images_N whose longer side is the
/// smallest that reaches `size` (else the largest). colmap: see parse_colmap_cameras(). World axes are
/// COLMAP's. Images as for llff, lenses and missing images as for transforms.
/// The type of the scene is decided from the images and cameras, not from the layout. Of a plain scene, the
/// background becomes transparent (cut_out()). Of a place, pixels that are not opaque are not valid.
/// @throws ValueError  if an option is outside its range, or the views cannot be of the scene type asked for
/// @throws IoError     naming file and place: folder, JSON or an image missing, unreadable or malformed, no
///                     views, images of differing sizes, a distortion that has no inverse, none of the
///                     files above
Dataset load_dataset(const std::filesystem::path& folder, const DatasetOptions& options = {});

/// The layout that load_dataset() finds. @throws IoError if there is no folder or none of the layouts' files
Layout find_layout(const std::filesystem::path& folder);
/// Whether the data set has an image of this split. The layouts llff and colmap hold out views and always do.
/// @throws ValueError unless split is train, val or test   @throws IoError as find_layout(), or where a JSON
/// is malformed
bool has_split(const std::filesystem::path& folder, std::string_view split);

/// A view in front of a background: rgb * alpha + background * (1 - alpha), [height, width, 3].
Tensor<float> composited(const View& view, Background background);

/// 1 for white, 0 for black.
float background_value(Background background);

}  // namespace fieldmark::nerf
