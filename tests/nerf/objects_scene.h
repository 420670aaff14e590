#pragma once
#include <fieldmark/nerf/analytic_scene.h>

/// Returns twelve views of the built-in scene at 48 x 48 pixels; built once per process.
inline const fieldmark::nerf::Dataset& objects_scene() {
  static const fieldmark::nerf::Dataset data = fieldmark::nerf::make_scene({.size = 48, .views = 12});
  return data;
}
