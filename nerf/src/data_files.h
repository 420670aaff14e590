#pragma once
#include <fieldmark/engine/shape.h>
#include <filesystem>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// The image files that the cameras of a data set name.
struct DataFiles {
  /// Those of a split.
  struct Split {
    std::string split;                           ///< "train", "val" or "test"
    std::vector<std::filesystem::path> files{};  ///< of its images, one a camera
    std::vector<std::string> missing{};          ///< images that cameras name and that do not exist
  };
  std::vector<Split> splits{};  ///< those that the data set states
  /// Image files in the folders of the others that no camera of any split has, sorted; without masks, and
  /// without those of the name of one that is used with '_' or '.' and more behind it.
  std::vector<std::filesystem::path> unused{};
};

/// @param size  as DatasetOptions::size   @throws IoError as load_dataset() before it reads images
DataFiles list_files(const std::filesystem::path& folder, Index size);

}  // namespace fieldmark::nerf
