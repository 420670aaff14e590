#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <span>

namespace fieldmark {

/// Decodes a WebP file as [H, W, 3 or 4], multiples of 1/255.
/// @throws Undecodable if it is damaged, an animation, too large, or this build lacks libwebp
Tensor<float> decode_webp(std::span<const std::byte> bytes);

}  // namespace fieldmark
