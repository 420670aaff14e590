#pragma once
// Reads the images and masks of a split, brings them to pinhole cameras, resizes them and pads them to one
// size.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture.h"

namespace fieldmark::nerf {

/// The part that all lenses cover in the images of one stated size.
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
  std::vector<std::filesystem::path> files{};  ///< of the images, one per shot
  std::vector<std::filesystem::path> masks{};  ///< one per shot; empty: none
  Index size = 0;                              ///< longer side before images are cropped, pixels; 0: original
  std::vector<LensPart> parts{};               ///< one per stated size if there are lenses, else none
  bool resampled = false;                      ///< see DatasetOptions
};

/// Fills in ViewPlan::parts and describes them in `notes`.
/// @param all  the shots of all splits, whose parts are the same
/// @throws IoError  naming the place of a shot whose lens has no inverse or leaves no part
void plan_lenses(const std::vector<Shot>& all, ViewPlan& plan, std::vector<std::string>& notes);

/// Reads the views in parallel. Images of one stated size must have the same size; smaller images of other
/// sizes are padded at the right and bottom, where View::valid is then 0.
/// @throws IoError  naming the place of the first image, by number, that is unreadable or of another size,
///                  or whose mask is; or of the first image if masks exclude every pixel
std::vector<View> read_views(const ViewPlan& plan, std::vector<std::string>& notes);

}  // namespace fieldmark::nerf
