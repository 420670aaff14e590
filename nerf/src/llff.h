#pragma once
#include <fieldmark/nerf/dataset.h>
#include "lens.h"

#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// One row of a poses_bounds.npy.
struct LlffView {
  Pose pose{};              ///< from the camera to the world, OpenGL axes
  Intrinsics intrinsics{};  ///< one focal length in pixels of the stated size
  DepthRange depth{};       ///< of the view, in units of the pose
};

/// Reads the bytes of a poses_bounds.npy: N x 17 floats, each row a 3 x 5 matrix, row-major, of the camera's
/// axes (down, right, backwards), its position and (height, width, focal length) of the images at original
/// size, then the near and far bound. Axes become OpenGL's (right, up, backwards); rotations are read as in
/// parse_transforms(). Source: Mildenhall et al. 2019 (LLFF), the layout of its repository.
/// @param name  stands for the path in errors
/// @throws IoError  naming row and number, what was expected and what was found: not an array of N x 17,
///                  N >= 1, a number that is NaN or outside +-1e9, no rotation, a size outside 1 to 65536, a
///                  focal length that is not positive, bounds without 1e-9 < near < far
std::vector<LlffView> parse_poses_bounds(std::string_view bytes, std::string_view name);

/// Scales the world so that the nearest near bound is 4/3, then turns and moves it so that the mean camera is
/// at the origin and looks along -z: its position is the mean of the positions, its backward axis z the mean
/// of the backward axes, its right axis (mean up) x z. Source: the loader of Mildenhall et al. 2020 (NeRF)
/// for LLFF scenes (bounds factor 0.75, recentring).
/// @return  the scale factor
/// @throws ValueError  if there are no views, or their mean axes vanish or are parallel
double recentre_llff(std::vector<LlffView>& views);

}  // namespace fieldmark::nerf
