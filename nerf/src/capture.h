#pragma once
// The images and cameras that a folder names, before any image is read.
#include <fieldmark/core/error.h>
#include <fieldmark/nerf/dataset.h>

#include <filesystem>
#include <string>
#include <vector>

#include "lens.h"

namespace fieldmark::nerf {

/// An image that a file names, and its camera.
struct Shot {
  std::filesystem::path image;  ///< with or without extension
  std::string label;            ///< "frames[3]": its name in the errors of other shots
  std::string place;            ///< "transforms.json: frames[3].file_path": the beginning of its errors
  Pose pose{};
  Intrinsics intrinsics{};
  std::optional<DepthRange> depth{};
};

struct Capture {
  std::vector<Shot> shots{};  ///< of one split (blender), or of all
  bool all_splits = false;    ///< whether every 8th is yet to be held out
  bool may_miss = false;      ///< whether a missing image is left out
  bool forward_facing = false;
  std::vector<std::string> notes{};
};

Capture read_blender(const std::filesystem::path& folder, const std::string& split);
Capture read_transforms(const std::filesystem::path& folder);
/// @param size  wanted pixels of the longer side, 0: the largest there are
Capture read_llff(const std::filesystem::path& folder, Index size);

/// The folder of a COLMAP model: sparse/0, sparse or the folder itself; empty where there is none.
std::filesystem::path colmap_folder(const std::filesystem::path& folder);
Capture read_colmap(const std::filesystem::path& folder, Index size);

/// The image files of a folder, sorted by name; none where there is no folder.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);
/// The file of a shot's image, with .png, .jpg or .jpeg where its name has no extension; empty: none.
std::filesystem::path image_file(const Shot& shot);

/// The result of make(), whose errors become IoErrors that begin with `place`.
auto at_place(const std::string& place, const auto& make) {
  try {
    return make();
  } catch (const Error& e) {
    throw IoError(place + ": " + e.what());
  }
}

}  // namespace fieldmark::nerf
