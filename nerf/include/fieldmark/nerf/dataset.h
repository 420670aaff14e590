#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/camera.h>
#include <fieldmark/nerf/scene_type.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
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

/// The depth range of the scene in a view, along the viewing axis.
struct DepthRange {
  double near = 0;  ///< length, > 0
  double far = 0;   ///< length, > near
};

/// Displacements within an image, pixels (x right, y down), [height * width] in row order.
using PixelOffsets = std::vector<std::array<float, 2>>;

/// A ground truth image and its camera.
struct View {
  Camera camera;                      ///< of the size of the image
  Tensor<float> rgba;                 ///< [height, width, 4] in [0, 1], straight (not premultiplied) alpha
  std::string name;                   ///< file name without folder and extension: "r_12"
  std::optional<DepthRange> depth{};  ///< layout llff only
  /// [height * width] 0 for pixels that a mask excludes, a lens does not show or that do not exist, which
  /// training and metrics ignore, else 1; empty: all are valid
  std::vector<std::uint8_t> valid{};
  /// Displacement from each pixel's centre to the point where its colour was seen; null: none. See
  /// DatasetOptions::resampled. The rays of a supersampled pixel spread over one pixel of this view around
  /// that point.
  std::shared_ptr<const PixelOffsets> offsets{};
  Index file_width = 0;   ///< of the image file, pixels; 0: there is none
  Index file_height = 0;  ///< of the image file, pixels; 0: there is none
  Index own_width = 0;    ///< pixels from the left that show the image, the rest is padding; 0: all
  Index own_height = 0;   ///< pixels from the top that show the image, the rest is padding; 0: all
};

/// One split of a data set in memory.
struct Dataset {
  std::string name;                           ///< folder name: "lego"
  std::string split;                          ///< "train", "val" or "test"
  Background background = Background::white;  ///< behind its views
  std::vector<View> views;                    ///< at least one; all of the same size
  Layout layout = Layout::blender;            ///< of the folder
  SceneType scene = SceneType::object;        ///< detected from images and cameras, or as requested
  std::string scene_reason{};                 ///< human-readable reason for the scene type
  /// Scene plain: the background colour, which some opaque pixels may still show. Transparent pixels are
  /// certainly background.
  std::array<float, 3> plain_colour{};
  std::vector<std::string> notes{};  ///< human-readable: one sentence per omission, crop and hold-out
};

/// Split, size, background and scene type for load_dataset().
struct DatasetOptions {
  std::string split = "train";  ///< "train", "val" or "test"
  /// Longer side in pixels after area filtering of premultiplied colour, before undistortion crops the rims;
  /// 0: original size.
  Index size = 0;
  /// Background of the views; none: for scene object, white in layout blender, else black; for scene plain,
  /// the one nearer to its colour; else black.
  std::optional<Background> background{};
  /// Type of the scene; none: detected from images and cameras, see look_at_scene().
  std::optional<SceneType> scene{};
  /// Views to read, spread evenly over the split; 0: all.
  Index most_views = 0;
  /// False: if a lens of the data set distorts, each pixel of a view has the colour of the nearest pixel of
  /// the image, and View::offsets say where that was seen. Nothing is softened, but neighbours are not evenly
  /// spaced. True: such images are interpolated, see undistorted_image(), for methods that filter whole
  /// images.
  bool resampled = false;
};

/// Reads one split of a data set. The layout is that of the first of these files that the folder has:
/// transforms_train.json (or _val, _test), transforms.json, poses_bounds.npy, cameras.bin or cameras.txt (in
/// sparse/0, sparse or the folder itself). All layouts but blender hold out every 8th image (0, 8, 16, ... of
/// the sorted names) as val and test, and use the others for train. Images without alpha are opaque. Images
/// are also found if their names have backslashes, another case or another extension; for transforms, an
/// absolute path from another computer is matched by its end.
///
/// Masks: the file named by a frame's mask_path, where black excludes a pixel, or dynamic_mask_NAME.png next
/// to image NAME, where black keeps it; see View::valid.
/// transforms: see parse_transforms(). Where train_filenames, val_filenames or test_filenames list frames,
/// they define the splits: val and test stand in for one another, and train has the remaining frames. Frames
/// without an image are skipped, with a note. Distorted images are brought to a pinhole camera
/// (DatasetOptions::resampled) and cropped to the part that every lens of the file covers. llff: see
/// parse_poses_bounds(); recentre_llff() recentres and rescales the poses. Images come from the folder images
/// or images_N with the smallest longer side of at least `size` (else the largest). colmap: see
/// parse_colmap_cameras(). World axes are COLMAP's. Images are chosen as for llff; lenses and missing images
/// are handled as for transforms.
/// The type of the scene is decided from the images and cameras, not from the layout. In a plain scene, the
/// background becomes transparent (cut_out()). In a place, pixels that are not opaque are not valid.
/// @throws ValueError  if an option is outside its range, or the views cannot have the requested scene type
/// @throws IoError     naming file and place: folder, JSON or an image missing, unreadable or malformed, no
///                     views, images of differing sizes, a distortion that has no inverse, none of the
///                     files above
Dataset load_dataset(const std::filesystem::path& folder, const DatasetOptions& options = {});

/// Returns the layout that load_dataset() finds. @throws IoError if the folder is missing or has none of its
/// files
Layout find_layout(const std::filesystem::path& folder);
/// Returns true if the data set has an image of this split; always for layouts llff and colmap, which hold
/// out views.
/// @throws ValueError unless split is train, val or test   @throws IoError as find_layout(), or if a JSON is
/// malformed
bool has_split(const std::filesystem::path& folder, std::string_view split);

/// Composites a view over a background: rgb * alpha + background * (1 - alpha), [height, width, 3].
Tensor<float> composited(const View& view, Background background);

/// Returns 1 for white, 0 for black.
float background_value(Background background);

}  // namespace fieldmark::nerf
