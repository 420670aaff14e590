#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <span>

namespace fieldmark {

/// An AVIF file, of a sequence its first image, as [H, W, 3 or 4]: multiples of 1/255, of 1/65535 for more
/// than 8 bits. Turned and mirrored as the file asks for it.
/// @throws Undecodable if it is damaged, too large, or this build lacks libavif
Tensor<float> decode_avif(std::span<const std::byte> bytes);

}  // namespace fieldmark
