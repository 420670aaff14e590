#pragma once
#include <fieldmark/nerf/data_survey.h>

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// A size of image files and the number of files that have it.
struct ImageSize {
  Index width = 0;   ///< pixels
  Index height = 0;  ///< pixels
  Index count = 0;   ///< files of this size, >= 1
};

/// A split of a data set.
struct SplitReport {
  std::string split;      ///< "train", "val" or "test"
  Index images = 0;       ///< images that cameras have
  Index missing = 0;      ///< images that cameras name but that do not exist
  std::string same_as{};  ///< the split that has the same images; empty: none
};

/// A camera as drawn by camera_chart().
struct ReportedCamera {
  std::string name;       ///< as View::name
  std::string split;      ///< "train", "val" or "test"
  Camera camera;          ///< of the image as loaded
  bool outlying = false;  ///< true if odd_views() finds it outlying
};

/// The contents of a data set and its oddities.
struct DataReport {
  std::string name{};                         ///< of the folder
  Layout layout = Layout::blender;            ///< of the files
  SceneType scene = SceneType::object;        ///< of the training images
  std::string scene_reason{};                 ///< human-readable reason for the scene type
  Background background = Background::white;  ///< behind the views
  std::vector<ImageSize> sizes{};             ///< of all image files, the most frequent first
  Index masked_images = 0;                    ///< images in which masks exclude a pixel
  std::vector<SplitReport> splits{};          ///< splits that the data set defines
  std::vector<ReportedCamera> cameras{};      ///< of all splits, each image once
  Vec3 centre{};                              ///< of the scene: the point that the cameras look at
  Vec3 up{0, 0, 1};                           ///< unit, see CameraSpan
  std::array<double, 3> distances{};          ///< of cameras from `centre`: least, median, largest; length
  double spread = 0;                          ///< largest angle between their directions from it, degrees
  std::array<double, 2> fields_of_view{};     ///< horizontal: least and largest, degrees
  std::vector<Oddity> oddities{};             ///< of odd_views(), twins() and odd_files()
  std::vector<std::string> notes{};           ///< of load_dataset()
};

/// Loads all splits of a data set, one after another, with load_dataset() and examines them.
/// @param options  split and most_views are not used
/// @param progress  called after each split with the share of images read, in [0, 1]; returns false to stop,
/// and the report then has no sizes, cameras or oddities
/// @throws IoError, ValueError  as load_dataset(), also if there are no training images
DataReport report_data(const std::filesystem::path& folder, const DatasetOptions& options = {},
                       const std::function<bool(double)>& progress = {});

/// Returns "blender", "transforms", "llff" or "colmap".
std::string name_of(Layout layout);

}  // namespace fieldmark::nerf
