#pragma once
#include "camera_motion.h"

#include <algorithm>
#include <cmath>
#include <vector>

/// Returns how far apart two cameras see points about the origin: the median in pixels.
inline double cameras_apart(const fieldmark::nerf::Camera& a, const fieldmark::nerf::Camera& b) {
  using namespace fieldmark::watermark;
  std::vector<double> distances;
  for (const double x : {-0.4, 0.0, 0.4})
    for (const double y : {-0.4, 0.0, 0.4})
      for (const double z : {-0.2, 0.1, 0.4}) {
        const Projection p = project(a, {x, y, z}), q = project(b, {x, y, z});
        distances.push_back(std::hypot(p.x - q.x, p.y - q.y));
      }
  std::sort(distances.begin(), distances.end());
  return distances[distances.size() / 2];
}
