#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include <cstdint>
#include <vector>

/// Colours at [N, 3] places after the owner's mark of these signs; directions are the places.
inline std::vector<float> marked(const fieldmark::watermark::Owner& owner,
                                 const std::vector<std::int8_t>& signs, const fieldmark::Tensor<float>& x,
                                 std::vector<float> rgb) {
  owner.marking(signs)(x.data.data(), x.data.data(), x.shape[0], rgb.data());
  return rgb;
}
