#pragma once
// The images and masks of a split: read, freed of lens distortion, resized and brought to one size.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture.h"

namespace fieldmark::nerf {

/// The part of the images of one stated size that all their lenses cover.
struct LensPart {
  Index stated_width = 0;   ///< Intrinsics::width of the shots, 0: not stated
  Index stated_height = 0;  ///< Intrinsics::height of the shots, 0: not stated
  Index width = 0;          ///< pixels of the image files
  Index height = 0;         ///< pixels of the image files
  Crop part{};              ///< of the image files
};

/// The views of a split before their images are read.
struct ViewPlan {
  std::vector<Shot> shots{};
  std::vector<std::filesystem::path> files{};  ///< of the images, one a shot
  std::vector<std::filesystem::path> masks{};  ///< one a shot; empty: none
  Index size = 0;                              ///< longer side before images are cut, pixels; 0: as they are
  std::vector<LensPart> parts{};               ///< one a stated size where there are lenses, else none
};

/// Fills in ViewPlan::parts, and tells of them in `notes`.
/// @param all  the shots of all splits, whose parts are the same
/// @throws IoError  naming the place of a shot whose lens has no inverse or leaves no part
void plan_lenses(const std::vector<Shot>& all, ViewPlan& plan, std::vector<std::string>& notes);

/// Reads the views in parallel. Images of one stated size must be of one size; smaller ones of other sizes
/// are filled up at the right and below, where View::valid is then 0.
/// @throws IoError  naming the place of the first image, by number, that is unreadable or of another size,
///                  or whose mask is; or of the first image if masks exclude every pixel
std::vector<View> read_views(const ViewPlan& plan, std::vector<std::string>& notes);

}  // namespace fieldmark::nerf
