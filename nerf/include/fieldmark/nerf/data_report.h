#pragma once
#include <fieldmark/nerf/data_survey.h>

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// A size of image files and how many have it.
struct ImageSize {
  Index width = 0;   ///< pixels
  Index height = 0;  ///< pixels
  Index count = 0;   ///< of the files, >= 1
};

/// A split of a data set.
struct SplitReport {
  std::string split;      ///< "train", "val" or "test"
  Index images = 0;       ///< that cameras have
  Index missing = 0;      ///< that cameras name and that do not exist
  std::string same_as{};  ///< the split whose images these are; empty: none
};

/// A camera as camera_chart() draws it.
struct ReportedCamera {
  std::string name;       ///< as View::name
  std::string split;      ///< "train", "val" or "test"
  Camera camera;          ///< of the image as loaded
  bool outlying = false;  ///< whether odd_views() names it so
};

/// What a data set holds, and what is odd about it.
struct DataReport {
  std::string name{};                         ///< of the folder
  Layout layout = Layout::blender;            ///< of the files
  SceneType scene = SceneType::object;        ///< of the training images
  std::string scene_reason{};                 ///< for people: why it is of this type
  Background background = Background::white;  ///< behind the views
  std::vector<ImageSize> sizes{};             ///< of all image files, the most frequent first
  Index masked_images = 0;                    ///< of which masks exclude a pixel
  std::vector<SplitReport> splits{};          ///< those that the data set states
  std::vector<ReportedCamera> cameras{};      ///< of all splits, each image once
  Vec3 centre{};                              ///< of the scene: the point that the cameras look at
  Vec3 up{0, 0, 1};                           ///< unit, see CameraSpan
  std::array<double, 3> distances{};          ///< of cameras from `centre`: least, median, largest; length
  double spread = 0;                          ///< largest angle between their directions from it, degrees
  std::array<double, 2> fields_of_view{};     ///< horizontal: least and largest, degrees
  std::vector<Oddity> oddities{};             ///< of odd_views(), twins() and odd_files()
  std::vector<std::string> notes{};           ///< of load_dataset()
};

/// Reads all splits of a data set, one after another, as load_dataset() gives them, and examines them.
/// @param options  split and most_views are not used
/// @param progress  is called after each split with the share of images read, in [0, 1]; false ends the work,
/// and the report is then without sizes, cameras and oddities
/// @throws IoError, ValueError  as load_dataset(), also where there are no training images
DataReport report_data(const std::filesystem::path& folder, const DatasetOptions& options = {},
                       const std::function<bool(double)>& progress = {});

/// "blender", "transforms", "llff" or "colmap".
std::string name_of(Layout layout);

}  // namespace fieldmark::nerf
