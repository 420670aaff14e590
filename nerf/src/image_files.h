#pragma once
// Finds the image files that a data set names, under the names that people's systems gave them.
#include <fieldmark/engine/tensor.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// A path with slashes for backslashes, normalised. Files from Windows have backslashes.
std::filesystem::path with_slashes(const std::filesystem::path& path);

/// The image files of a folder (see has_image_extension()), sorted by name, without hidden files and
/// masks (dynamic_mask_NAME.png); none where there is no folder.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

/// The folder images or images_N in `folder` whose longer side is the smallest that reaches `size` (else, and
/// for 0, the largest); the folder input where there is none of them; empty where none has images.
std::filesystem::path image_folder(const std::filesystem::path& folder, Index size);

/// Finds files by name; lists each folder once.
class ImageFinder {
 public:
  /// The file of an image: under its name; with one of image_extensions() behind it; with slashes for
  /// backslashes; in another case, of folders too; with another of these extensions, also in place of that of
  /// another format, such as .tif. Empty: none.
  std::filesystem::path find(const std::filesystem::path& named);
  /// The longest end of an absolute path, of any system, that find() finds in `folder`, behind this folder:
  /// data sets move from one computer to another. Empty: none, or the path is not absolute.
  std::filesystem::path find_below(const std::filesystem::path& folder, const std::filesystem::path& named);

 private:
  using Listing = std::multimap<std::string, std::filesystem::path>;  // by stem in lower case
  const Listing& listing(const std::filesystem::path& folder);
  std::filesystem::path alike(const std::filesystem::path& named);
  std::map<std::filesystem::path, Listing> listings_;
};

}  // namespace fieldmark::nerf
