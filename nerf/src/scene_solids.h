#pragma once
#include <fieldmark/nerf/analytic_scene.h>

#include <cstdint>
#include <vector>

#include "solids.h"

namespace fieldmark::nerf {

/// A sphere inside a solid that casts its shadow.
struct Shade {
  Vec3 centre;
  double radius;
};

/// A solid of a built-in scene, its appearance and its shadow.
struct SceneSolid {
  Solid solid;
  SolidTexture texture;
  std::vector<Shade> shades;  ///< none: it casts no shadow
  double gloss = 0;           ///< share of the light that is mirrored, in [0, 1]
};

/// Makes the solids of a built-in scene, within 1.2 of the origin. @param seed  of placement and colours
std::vector<SceneSolid> scene_solids(SceneKind kind, std::uint64_t seed);

}  // namespace fieldmark::nerf
