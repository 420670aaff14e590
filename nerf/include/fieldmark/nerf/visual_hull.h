#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/camera.h>

#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark::nerf {

/// A cube in world coordinates: positions x map to (x - corner) / side in [0, 1]^3.
struct Bounds {
  std::array<double, 3> corner{-1.5, -1.5, -1.5};  ///< the least x, y and z
  double side = 3;                                 ///< length of an edge, > 0
};

/// A photograph's silhouette with the camera that took it.
struct Silhouette {
  Camera camera;               ///< of the size of the image
  const Tensor<float>* image;  ///< [H, W, 4], alpha last
};

/// The visual hull (Laurentini 1994): cells of a grid over `bounds` that no silhouette rules out.
/// A cell stays if in every view its projection, enlarged to the circle around its corners, touches a pixel
/// with alpha > 0, leaves the image, or lies behind the camera: it is never ruled out wrongly.
/// @param resolution  cells per axis, a multiple of 4, at most 512   @return one entry a cell, x fastest, 1
/// where it stays
/// @throws ShapeError if an image is not [H, W, 4]   @throws ValueError if resolution is out of range
std::vector<std::uint8_t> visual_hull(std::span<const Silhouette> silhouettes, const Bounds& bounds,
                                      Index resolution);

/// The smallest cube around the hull, enlarged by two cells; `bounds` itself if nothing or everything is
/// ruled out.
Bounds tighten(const Bounds& bounds, std::span<const std::uint8_t> hull, Index resolution);

}  // namespace fieldmark::nerf
