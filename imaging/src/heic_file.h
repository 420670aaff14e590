#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <span>

namespace fieldmark {

/// The primary image of a HEIC file as [H, W, 3 or 4]: multiples of 1/255, of 1/(2^bits - 1) for more bits.
/// Turned, mirrored and cropped as the file asks for it.
/// @throws Undecodable if it is damaged, too large, or this build lacks libheif
Tensor<float> decode_heic(std::span<const std::byte> bytes);

}  // namespace fieldmark
