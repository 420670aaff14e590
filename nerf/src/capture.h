#pragma once
// The images and cameras of a folder, before any image is read.
#include <fieldmark/core/error.h>
#include <fieldmark/nerf/dataset.h>

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "lens.h"

namespace fieldmark::nerf {

/// The splits, in the order of Shot::in_split.
inline constexpr std::array<std::string_view, 3> kSplitNames{"train", "val", "test"};

/// An image that a file names, and its camera.
struct Shot {
  std::filesystem::path image;  ///< with or without extension
  std::string label;            ///< "frames[3]": its name in errors about other shots
  std::string place;            ///< "transforms.json: frames[3].file_path": how its errors begin
  Pose pose{};
  Intrinsics intrinsics{};
  std::optional<DepthRange> depth{};
  std::filesystem::path mask{};    ///< of mask_path; empty: none is named
  bool as_stored = false;          ///< true if the pose holds for pixels as stored, whatever their EXIF data
  std::array<bool, 3> in_split{};  ///< train, val, test: true if the file's own split has it
};

struct Capture {
  std::vector<Shot> shots{};  ///< of one split (blender), or of all
  bool all_splits = false;    ///< true if every 8th is yet to be held out
  bool listed = false;        ///< true if Shot::in_split decides the splits
  bool may_miss = false;      ///< true if a missing image is skipped, not an error
  bool forward_facing = false;
  std::vector<std::string> notes{};
};

/// Returns the index of a split in kSplitNames. @throws ValueError if it is none of them
std::size_t split_number(std::string_view split);
/// Returns true if a split has shot i.
bool belongs(const Capture& capture, std::size_t i, std::size_t split);

/// Reads the shots of a folder of this layout.
/// @param split  of layout blender   @param size  as for read_llff()
Capture read_capture(const std::filesystem::path& folder, Layout layout, const std::string& split,
                     Index size);
Capture read_blender(const std::filesystem::path& folder, const std::string& split);
Capture read_transforms(const std::filesystem::path& folder);
/// @param size  wanted pixels of the longer side, 0: the largest available
Capture read_llff(const std::filesystem::path& folder, Index size);

/// Returns the folder of the COLMAP model with the most images among those in the first of these places that
/// has any: sparse/*, sparse, the folder itself, the same in colmap, in dense and in dense/*, and *. Empty if
/// there is none.
/// @param choice  receives a note on the models to choose from, unless null
std::filesystem::path colmap_folder(const std::filesystem::path& folder,
                                    std::vector<std::string>* choice = nullptr);
Capture read_colmap(const std::filesystem::path& folder, Index size);

/// Returns the result of make(); its errors become IoErrors that begin with `place`.
auto at_place(const std::string& place, const auto& make) {
  try {
    return make();
  } catch (const Error& e) {
    throw IoError(place + ": " + e.what());
  }
}

}  // namespace fieldmark::nerf
