#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include <cstdint>
#include <vector>

/// Returns the colours at positions [N, 3] after the owner's mark with these signs; the positions serve as
/// directions too.
inline std::vector<float> marked(const fieldmark::watermark::Owner& owner,
                                 const std::vector<std::int8_t>& signs, const fieldmark::Tensor<float>& x,
                                 std::vector<float> rgb) {
  owner.marking(signs)(x.data.data(), x.data.data(), x.shape[0], rgb.data());
  return rgb;
}
