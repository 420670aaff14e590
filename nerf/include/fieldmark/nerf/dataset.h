#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/camera.h>

#include <filesystem>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// What is behind the scene where a picture is not opaque.
enum class Background { white, black };

/// A photograph and the camera that took it.
struct View {
  Camera camera;       ///< of the size of the picture
  Tensor<float> rgba;  ///< [height, width, 4] in [0, 1], straight (not premultiplied) alpha
  std::string name;    ///< as in the data set, without folder and extension: "r_12"
};

/// One split of a data set in memory.
struct Dataset {
  std::string name;                           ///< of the folder: "lego"
  std::string split;                          ///< "train", "val" or "test"
  Background background = Background::white;  ///< in front of which its views are shown
  std::vector<View> views;                    ///< at least one; all of one size
};

/// What load_dataset() reads, and at what size.
struct DatasetOptions {
  std::string split = "train";  ///< "train", "val" or "test"
  Index size = 0;  ///< pixels of the longer side after an area filter on premultiplied colour; 0: as it is
  Background background = Background::white;  ///< of the Dataset that is made
};

/// Reads one split of a data set in the layout of the Blender scenes of Mildenhall et al. 2020 (NeRF): a
/// folder with transforms_{train,val,test}.json and the pictures they name. Pictures without alpha are taken
/// as opaque.
/// @throws ValueError  if an option is outside its range
/// @throws IoError     naming file and place: folder, JSON or a picture missing, unreadable or malformed (see
///                     parse_transforms()), no views, pictures of differing sizes
Dataset load_dataset(const std::filesystem::path& folder, const DatasetOptions& options = {});

/// A view in front of a background: rgb * alpha + background * (1 - alpha), [height, width, 3].
Tensor<float> composited(const View& view, Background background);

/// 1 for white, 0 for black.
float background_value(Background background);

}  // namespace fieldmark::nerf
