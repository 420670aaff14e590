#pragma once
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/radiance_field.h>

#include <vector>

namespace fieldmark::watermark {

/// Novel cameras and, of an object that has no surroundings (a cube), `around` more in every direction: what
/// its field shows from where no training image was taken is as firm as the rest, while other scenes show
/// blur there.
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
