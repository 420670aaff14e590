#pragma once
#include <fieldmark/nerf/dataset.h>
#include "intrinsics.h"

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// How a file of a COLMAP sparse model is written.
enum class ColmapFormat {
  text,   ///< cameras.txt, images.txt, points3D.txt
  binary  ///< cameras.bin, images.bin, points3D.bin, little endian
};

/// A photograph of a model.
struct ColmapImage {
  std::string name;                   ///< of the image, below the folder of images
  Pose pose{};                        ///< from the camera to the world, OpenGL axes; the world is COLMAP's
  std::uint32_t camera = 0;           ///< key of its camera
  std::vector<std::uint64_t> points;  ///< keys of the points it was seen to show
};

/// @{
/// Reads a file of a COLMAP sparse model.
/// Source: COLMAP's documentation, "Output format". Camera models: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL,
/// RADIAL, OPENCV. Quaternions of a length within 1e-2 of 1 are normalised. Colours, errors and tracks are
/// skipped.
/// @param name  stands for the path in errors
/// @throws IoError  naming line or byte, what was expected and what was found: an end too early, a count that
///                  the bytes left cannot hold, something after the end, another camera model (by name), a
///                  number that is NaN or outside its range, a key that comes twice, no cameras or images
std::map<std::uint32_t, Intrinsics> parse_colmap_cameras(std::string_view bytes, ColmapFormat format,
                                                         std::string_view name);
std::vector<ColmapImage> parse_colmap_images(std::string_view bytes, ColmapFormat format,
                                             std::string_view name);
std::map<std::uint64_t, Vec3> parse_colmap_points(std::string_view bytes, ColmapFormat format,
                                                  std::string_view name);
/// @}

/// From where to where a photograph shows the model's points: the 0.1% and 99.9% quantiles of their depths
/// before the camera (as LLFF takes its bounds), none where it shows fewer than two depths.
/// @throws ValueError  if the photograph names a point that is not there
std::optional<DepthRange> colmap_depth(const ColmapImage& image, const std::map<std::uint64_t, Vec3>& points);

}  // namespace fieldmark::nerf
