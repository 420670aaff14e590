#pragma once
// The distance of a pose from a rotation, and the nearest rotation.
#include <fieldmark/core/worst.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <tuple>

#include "vec3.h"

namespace fieldmark::nerf {

inline Vec3 pose_column(const Pose& p, std::size_t c) { return {p[c], p[4 + c], p[8 + c]}; }

/// Returns the larger of the largest entry of |R^T R - I| and the determinant's difference from 1.
inline double rotation_error(const Pose& p) {
  const Vec3 x = pose_column(p, 0), y = pose_column(p, 1), z = pose_column(p, 2);
  double worst = std::abs(dot(cross(x, y), z) - 1);
  for (const auto& [a, b, want] :
       {std::tuple{x, x, 1.0}, {y, y, 1.0}, {z, z, 1.0}, {x, y, 0.0}, {x, z, 0.0}, {y, z, 0.0}})
    raise_to(worst, std::abs(dot(a, b) - want));
  return worst;
}

/// Returns a pose with its matrix replaced by the nearest rotation (its polar factor), by R <- (R + R^-T) /
/// 2, which squares a small error at each step.
inline Pose with_rotation(Pose p) {
  for (int step = 0; step < 8; ++step) {
    const Vec3 x = pose_column(p, 0), y = pose_column(p, 1), z = pose_column(p, 2);
    const double d = dot(cross(x, y), z);
    const Vec3 inverse[] = {cross(y, z), cross(z, x), cross(x, y)};  // columns of d R^-T
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) p[4 * r + c] = 0.5 * (p[4 * r + c] + inverse[c][r] / d);
  }
  return p;
}

/// Returns the length of the three columns if it is the same to 0.1%, else 0.
inline double common_scale(const Pose& p) {
  const double x = norm(pose_column(p, 0)), y = norm(pose_column(p, 1)), z = norm(pose_column(p, 2));
  const double least = std::min({x, y, z}), most = std::max({x, y, z});
  return least > 1e-9 && most <= 1.001 * least ? std::cbrt(x * y * z) : 0;
}

// Poses in single precision with six digits are 1e-6 off; they are kept.
inline constexpr double kRotationExact = 1e-5, kRotationTolerance = 1e-2;

/// Returns the pose, with the nearest rotation if it is off by more than kRotationExact; calls fail(found),
/// which throws, if it is off by more than kRotationTolerance.
template <class Fail>
Pose checked_rotation(const Pose& pose, Fail fail) {
  const double error = rotation_error(pose);
  if (error <= kRotationExact) return pose;
  if (!(error <= kRotationTolerance)) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", error);
    const Vec3 x = pose_column(pose, 0), y = pose_column(pose, 1), z = pose_column(pose, 2);
    char more[96];
    std::snprintf(more, sizeof more, ": they are of lengths %.4g, %.4g and %.4g, with a determinant of %.4g",
                  norm(x), norm(y), norm(z), dot(cross(x, y), z));
    fail(std::string("columns that are off orthonormal by ") + text + more);
  }
  return with_rotation(pose);
}

}  // namespace fieldmark::nerf
