#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <span>

namespace fieldmark {

/// Decodes an AVIF file, or the first image of a sequence, as [H, W, 3 or 4]: multiples of 1/255, or of
/// 1/65535 above 8 bits. Rotates and mirrors it as the file asks.
/// @throws Undecodable if it is damaged, too large, or this build lacks libavif
Tensor<float> decode_avif(std::span<const std::byte> bytes);

}  // namespace fieldmark
