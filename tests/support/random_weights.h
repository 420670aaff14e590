#pragma once
#include <fieldmark/imaging/pretrained_conv.h>

#include <cmath>
#include <span>

#include "support/random.h"

/// Returns a weight file in memory with random numbers in every tensor, scaled to keep signals alive through
/// ReLUs. Tensors whose names begin with `left_out` are omitted. Linear layers (lin...) and scales are
/// positive.
inline fieldmark::SafetensorsFile random_weights(std::span<const fieldmark::WeightTensor> tensors,
                                                 const std::string& left_out = "none") {
  fieldmark::SafetensorsFile file;
  file.path = "random.safetensors";
  unsigned seed = 1;
  for (const auto& t : tensors) {
    ++seed;
    if (t.name.starts_with(left_out)) continue;
    const bool positive = t.name.starts_with("lin") || t.name == "scaling.scale";
    const double fan = t.shape.rank() == 4 ? static_cast<double>(t.shape.size() / t.shape[0]) : 100;
    const double size = positive ? 1 : std::sqrt(6 / fan);
    file.add(t.name, t.shape,
             std::span<const float>(uniform<float>(t.shape, positive ? 0.2 : -size, size, seed).data));
  }
  return file;
}
