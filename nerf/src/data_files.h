#pragma once
#include <fieldmark/engine/shape.h>
#include <filesystem>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// The image files that the cameras of a data set name.
struct DataFiles {
  /// The image files of a split.
  struct Split {
    std::string split;                           ///< "train", "val" or "test"
    std::vector<std::filesystem::path> files{};  ///< of its images, one per camera
    std::vector<std::string> missing{};          ///< images that cameras name but that do not exist
  };
  std::vector<Split> splits{};  ///< splits that the data set defines
  /// Image files next to the others that no camera of any split has, sorted. Excludes masks and files whose
  /// name is that of a used image followed by '_' or '.' and more.
  std::vector<std::filesystem::path> unused{};
};

/// @param size  as DatasetOptions::size   @throws IoError as load_dataset() before it reads images
DataFiles list_files(const std::filesystem::path& folder, Index size);

}  // namespace fieldmark::nerf
