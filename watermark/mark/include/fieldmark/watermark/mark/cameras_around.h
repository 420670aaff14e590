#pragma once
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/radiance_field.h>

#include <vector>

namespace fieldmark::watermark {

/// Makes novel cameras and, for an object without surroundings (a cube), `around` more in every direction.
/// The field of such an object is as reliable from directions without training images as from others, while
/// other scenes show blur there.
/// @param size  as nerf::make_cameras()
inline std::vector<nerf::Camera> cameras_around(const nerf::RadianceField& field, Index near, Index around,
                                                Index size, std::uint64_t seed) {
  auto cameras = nerf::make_cameras(field.cameras, nerf::CameraSet::novel, near, size, seed);
  if (field.space.kind != nerf::SpaceKind::cube) return cameras;
  const auto more = nerf::make_cameras(field.cameras, nerf::CameraSet::sphere, around, size, seed);
  cameras.insert(cameras.end(), more.begin(), more.end());
  return cameras;
}

}  // namespace fieldmark::watermark
