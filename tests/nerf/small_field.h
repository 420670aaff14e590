#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <algorithm>

#include "support/random.h"

/// Options of a field small enough to render by brute force.
inline fieldmark::nerf::RadianceFieldOptions small_field_options() {
  return {.field = {.encoding = {.levels = 2,
                                 .features = 2,
                                 .log2_table = 8,
                                 .base_resolution = 4,
                                 .finest_resolution = 8},
                    .width = 8,
                    .geometry = 4},
          .occupancy = 16,
          .step = 1.f / 64};
}

/// Options of a field that learns a scene of 48 x 48 pixels in a hundred steps of 8192 samples.
inline fieldmark::nerf::RadianceFieldOptions trainable_field_options() {
  return {.field = {.encoding = {.levels = 4,
                                 .features = 2,
                                 .log2_table = 12,
                                 .base_resolution = 8,
                                 .finest_resolution = 64},
                    .width = 16,
                    .geometry = 8},
          .occupancy = 32,
          .step = 1.f / 128};
}

/// Options of a small version of the original field: networks of 3 layers of 16 units, 8 + 8 points per ray.
inline fieldmark::nerf::RadianceFieldOptions small_mlp_options() {
  return {.field = {.kind = fieldmark::nerf::FieldKind::mlp,
                    .mlp = {.layers = 3, .width = 16, .skip = 2, .position_bands = 4, .direction_bands = 2}},
          .occupancy = 32,
          .step = 1.f / 128,
          .points = {.average = 8, .importance = 8}};
}

/// Returns a smooth random field: table and networks have numbers large enough to matter, and the cameras
/// surround the origin.
inline fieldmark::nerf::RadianceField small_field(
    unsigned seed = 1, const fieldmark::nerf::RadianceFieldOptions& options = small_field_options()) {
  using namespace fieldmark;
  nerf::RadianceField field(options);
  const auto numbers = uniform<float>({field.params.size()}, -1, 1, seed);
  std::copy(numbers.data.begin(), numbers.data.end(), field.params.values().begin());
  std::vector<nerf::Camera> cameras;
  for (const double x : {-3.0, 0.5, 3.0})
    cameras.push_back(nerf::make_camera(nerf::look_at({x, -2.5, 1}, {0, 0, 0}, {0, 0, 1}), 0.7, 24, 18));
  field.cameras = nerf::camera_span(cameras, nerf::Background::white);
  return field;
}
