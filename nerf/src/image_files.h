#pragma once
// Finds the image files that a data set names, despite changes of the names between operating systems.
#include <fieldmark/engine/tensor.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// Replaces backslashes, which files from Windows have, by slashes and normalises the path.
std::filesystem::path with_slashes(const std::filesystem::path& path);

/// Returns the image files of a folder (see has_image_extension()), sorted by name, without hidden files and
/// masks (dynamic_mask_NAME.png); none if there is no folder.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

/// Returns the folder images or images_N in `folder` with the smallest longer side of at least `size` (else,
/// and for 0, the largest); the folder input if there are none of these; empty if none has images.
std::filesystem::path image_folder(const std::filesystem::path& folder, Index size);

/// Finds files by name; lists each folder once.
class ImageFinder {
 public:
  /// Finds the file of an image: by its name; with one of image_extensions() appended; with slashes for
  /// backslashes; in another case, also of folders; with another of these extensions, also instead of that of
  /// another format, such as .tif. Empty: none.
  std::filesystem::path find(const std::filesystem::path& named);
  /// Finds the longest tail of an absolute path, of any system, that find() finds in `folder`, and returns it
  /// below that folder: data sets move from one computer to another. Empty: none, or the path is not
  /// absolute.
  std::filesystem::path find_below(const std::filesystem::path& folder, const std::filesystem::path& named);

 private:
  using Listing = std::multimap<std::string, std::filesystem::path>;  // by stem in lower case
  const Listing& listing(const std::filesystem::path& folder);
  std::filesystem::path alike(const std::filesystem::path& named);
  std::map<std::filesystem::path, Listing> listings_;
};

}  // namespace fieldmark::nerf
