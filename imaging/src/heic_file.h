#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <span>

namespace fieldmark {

/// Decodes the primary image of a HEIC file as [H, W, 3 or 4]: multiples of 1/255, or of 1/(2^bits - 1) above
/// 8 bits. Rotates, mirrors and crops it as the file asks.
/// @throws Undecodable if it is damaged, too large, or this build lacks libheif
Tensor<float> decode_heic(std::span<const std::byte> bytes);

}  // namespace fieldmark
