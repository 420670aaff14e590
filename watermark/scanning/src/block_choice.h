#pragma once
// Whether blocks of an image are read together or apart. Private.
#include <fieldmark/watermark/scanning/page_reader.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace fieldmark::watermark {

/// Agreement of an image of several blocks that needs no second look.
inline constexpr double kSureTogether = 0.98;
/// By how much a part must agree better than the whole to contradict it.
inline constexpr double kClearly = 0.02;

/// True if a block that agrees with the field needs to be read no further.
/// @param reading  of the block   @param block  with the parts into which gaps divide it
inline bool is_sure(const ImageReading& reading, const ImageBlock& block) {
  return block.parts.empty() || reading.informed.agreement >= kSureTogether;
}

/// True if a part agrees clearly better than the whole, and is mirrored where the whole is not, or the
/// reverse. In a collage, the whole is aligned to one of the views. A nearly symmetric object agrees with its
/// own mirror image (lego by up to 0.957), so that camera may be wrong. A part of the same view has no such
/// contradiction, though it may agree better where something covers the rest.
inline bool contradicts(const ImageReading& part, const ImageReading& whole) {
  return part.mirrored != whole.mirrored && part.informed.agreement > whole.informed.agreement + kClearly;
}

/// Takes a block in place of the parts found in it, unless one of them contradicts it.
/// @param block  that agrees with the field   @param parts  found so far; others than the block's stay
inline void take_unless_contradicted(PartReading block, std::vector<PartReading>& parts) {
  const auto in_block = [&](const PartReading& part) {
    const PixelBox &in = part.box, &out = block.box;
    return in.x >= out.x && in.y >= out.y && in.x + in.width <= out.x + out.width &&
           in.y + in.height <= out.y + out.height;
  };
  const auto against = [&](const PartReading& part) {
    return in_block(part) && contradicts(part.reading, block.reading);
  };
  if (std::ranges::any_of(parts, against)) return;
  std::erase_if(parts, in_block);
  parts.push_back(std::move(block));
}

}  // namespace fieldmark::watermark
