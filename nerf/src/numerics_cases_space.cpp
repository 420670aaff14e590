#include <fieldmark/nerf/space.h>

#include <algorithm>
#include <cmath>

#include "numerics_cases_parts.h"

namespace fieldmark::nerf {
namespace {

using Real = long double;

// Contraction of p = 1/2 + y / 4 by its formula; in double through Space, whose inner cube is [-1, 1].
template <class T>
void compare_contraction(Real size, std::uint64_t seed, WorstError& error) {
  const auto y = scattered<T>({60, 3}, -1, 1, seed).data;
  for (std::size_t i = 0; i < y.size(); i += 3) {
    T p[3], got[3];
    Real s = 0, exact[3];
    for (std::size_t a = 0; a < 3; ++a) p[a] = static_cast<T>(T(0.5) + static_cast<T>(size) * y[i + a] / 4);
    for (std::size_t a = 0; a < 3; ++a) {
      exact[a] = 4 * (static_cast<Real>(p[a]) - Real(0.5));
      s = std::max(s, std::abs(exact[a]));
    }
    const Real scale = s <= 1 ? Real(0.25) : (2 - 1 / s) / (4 * s);
    if constexpr (std::is_same_v<T, float>) {
      contract(p, got);
    } else {
      const Space space{.kind = SpaceKind::contracted, .bounds = {.corner = {-1, -1, -1}, .side = 2}};
      const Vec3 x = space.to_cube({4 * (p[0] - 0.5), 4 * (p[1] - 0.5), 4 * (p[2] - 0.5)});
      std::copy(x.begin(), x.end(), got);
    }
    for (std::size_t a = 0; a < 3; ++a) {
      error.compare(got[a], Real(0.5) + scale * exact[a], 1);
      error.equal(got[a] >= 0 && got[a] <= 1, true);
    }
  }
}

// The direction of a ray's image: that of the difference of two points' images, from long double. The camera
// looks along (sideways, 0, -forward) from behind the plane; rays are float whatever the precision asked for.
void compare_device_direction(double sideways, double forward, WorstError& error) {
  const Space space{.kind = SpaceKind::ndc, .near = 1, .slope_x = 0.6, .slope_y = 0.8};
  const Vec3 eye{0.3, -0.2, -2};
  const Camera camera = make_camera(look_at(eye, {0.3 + sideways, -0.2, -2 - forward}, {0, 1, 0}), 0.5, 8, 8);
  const float pixels[] = {3.5f, 3.5f, 0, 7, 6, 1};
  CubeRays rays;
  rays.resize(3);
  rays.set(space, 0, camera, pixels);
  for (std::size_t i = 0; i < 9; i += 3) {
    const auto image = [&](Real t, std::size_t a) {
      const auto at = [&](std::size_t k) { return Real(eye[k]) + t * Real(rays.seen_from[i + k]); };
      if (a == 2) return 1 + Real(space.near) / at(2);
      return Real(0.5) - Real(a == 0 ? space.slope_x : space.slope_y) * at(a) / at(2);
    };
    Real along[3], length = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      along[a] = image(Real(0.01), a) - image(0, a);
      length += along[a] * along[a];
    }
    for (std::size_t a = 0; a < 3; ++a)
      error.compare(rays.directions[i + a], along[a] / std::sqrt(length), 1);
  }
}

}  // namespace

void add_space_numerics(std::vector<NumericsCase>& cases) {
  const auto contraction = [&](const char* what, Real least, Real most) {
    add_numerics(cases, std::string("space: contraction ") + what, "cube side", 1.5e-7, 3e-16,
                 [=](auto t, WorstError& e) {
                   for (Real size = least; size <= most; size *= 10)
                     compare_contraction<decltype(t)>(size, 5, e);
                 });
  };
  contraction("inside and about the inner cube", 1e-6L, 10);
  contraction("up to 1e15 times as far", 100, 1e15L);
  const auto device = [&](const char* what, double sideways, double forward) {
    add_numerics(cases, std::string("space: device coordinates, ") + what, "1", 1.2e-7, 1.2e-7,
                 [=](auto, WorstError& e) { compare_device_direction(sideways, forward, e); });
  };
  device("rays straight ahead", 0, 1);
  device("rays parallel to the plane", 1, 0);
  device("rays back towards the plane", 1, -0.2);
  device("rays off the axis by 1e-6", 1e-6, 1);
}

}  // namespace fieldmark::nerf
