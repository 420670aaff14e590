#pragma once
#include <fieldmark/nerf/dataset.h>
#include "lens.h"

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// The file format of a COLMAP sparse model.
enum class ColmapFormat {
  text,   ///< cameras.txt, images.txt
  binary  ///< cameras.bin, images.bin, little endian
};

/// An image of a model.
struct ColmapImage {
  std::string name;          ///< of the file, below the folder of images
  Pose pose{};               ///< from the camera to the world, OpenGL axes; the world is COLMAP's
  std::uint32_t camera = 0;  ///< key of its camera
};

/// @{
/// Reads a file of a COLMAP sparse model.
/// Source: COLMAP's documentation, "Output format". Camera models, in any case: SIMPLE_PINHOLE, PINHOLE,
/// SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, OPENCV_FISHEYE, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE.
/// Quaternions of a length within 1e-2 of 1 are normalised. Points are skipped; their lines may be missing.
/// @param name  stands for the path in errors
/// @throws IoError  naming line or byte, what was expected and what was found: an end too early, a count
///                  that the bytes left cannot hold, something after the end, another camera model (by name),
///                  a number that is NaN or out of range, a duplicate key, no cameras or images
std::map<std::uint32_t, Intrinsics> parse_colmap_cameras(std::string_view bytes, ColmapFormat format,
                                                         std::string_view name);
std::vector<ColmapImage> parse_colmap_images(std::string_view bytes, ColmapFormat format,
                                             std::string_view name);
/// @}

}  // namespace fieldmark::nerf
