#pragma once
// What the readers of the layouts find in a folder, before any image is read. Private.
#include <fieldmark/core/error.h>
#include <fieldmark/nerf/dataset.h>
#include "intrinsics.h"

#include <filesystem>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// An image that is named somewhere, and its camera.
struct Shot {
  std::filesystem::path image;  ///< with or without extension
  std::string label;            ///< "frames[3]": how other errors name it
  std::string place;            ///< "transforms.json: frames[3].file_path": where errors say it is named
  Pose pose{};
  Intrinsics intrinsics{};
  std::optional<DepthRange> depth{};
};

struct Capture {
  std::vector<Shot> shots{};  ///< of one split (blender), or of all
  bool all_splits = false;    ///< whether every 8th is yet to be held out
  bool may_miss = false;      ///< whether an image that is not there is left out
  bool forward_facing = false;
  std::optional<double> aabb_scale{};
  std::vector<Vec3> points{};
  std::vector<std::string> notes{};
};

Capture read_blender(const std::filesystem::path& folder, const std::string& split);
Capture read_transforms(const std::filesystem::path& folder);
/// @param size  pixels that the longer side is wanted to have, 0: as many as there are
Capture read_llff(const std::filesystem::path& folder, Index size);

/// The folder of a COLMAP model: sparse/0, sparse or the folder itself; empty where there is none.
std::filesystem::path colmap_folder(const std::filesystem::path& folder);
Capture read_colmap(const std::filesystem::path& folder, Index size);

/// Reads an image; IoError begins with the shot's place.
Tensor<float> read_shot(const Shot& shot, const std::filesystem::path& file);
/// The files of a folder that are called as images are, sorted by name; none where there is no folder.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);
/// The file that a shot's image is in, with .png, .jpg or .jpeg where that is not written; empty: none.
std::filesystem::path image_file(const Shot& shot);

}  // namespace fieldmark::nerf
