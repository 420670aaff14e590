#pragma once
#include <fieldmark/nerf/space.h>

#include <cmath>
#include <vector>

#include "support/random.h"

/// Rays as tests list them, whose view directions are their directions.
struct Rays {
  std::vector<float> origins, directions;
  fieldmark::nerf::RayBatch batch() const { return {origins, directions, directions}; }
};

/// Returns rays towards the cube from all around; every seventh misses it unless `misses` is false.
inline Rays some_rays(fieldmark::Index n, bool misses = true) {
  using fieldmark::Index;
  const auto u = uniform({n, 6}, -1, 1, 11);
  Rays rays;
  for (Index i = 0; i < n; ++i) {
    const double far = misses && i % 7 == 3 ? 9 : 0;
    double norm = 0;
    for (Index a = 0; a < 3; ++a) norm += u[6 * i + a] * u[6 * i + a];
    for (Index a = 0; a < 3; ++a) {
      const double direction = u[6 * i + a] / std::sqrt(norm);
      rays.origins.push_back(static_cast<float>(0.5 + 0.2 * u[6 * i + 3 + a] - 2 * direction + far));
      rays.directions.push_back(static_cast<float>(direction));
    }
  }
  return rays;
}
