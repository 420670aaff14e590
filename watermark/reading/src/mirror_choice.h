#pragma once
// When an image is read mirrored, too. Private.
#include <fieldmark/nerf/space.h>

namespace fieldmark::watermark {

/// Agreement at which no other camera is tried.
inline constexpr double kSure = 0.95;
/// Agreement at which an object is not tried mirrored. A symmetric one agrees with its mirror image, but not
/// so well: mirrored views of chair agree by up to 0.963 at a wrong camera, by 0.98 or more at the right one.
inline constexpr double kSureOfSide = 0.975;

/// True if an image that agrees with the field so well as it is should be tried mirrored.
inline bool is_side_doubtful(double agreement, nerf::SpaceKind space) {
  return agreement < (space == nerf::SpaceKind::cube ? kSureOfSide : kSure);
}

}  // namespace fieldmark::watermark
