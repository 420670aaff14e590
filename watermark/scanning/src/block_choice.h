#pragma once
// Whether blocks of an image are read together or apart. Private.
#include <fieldmark/watermark/scanning/page_reader.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace fieldmark::watermark {

/// Agreement of several blocks together that needs no second look. Below it, one of several views may agree
/// with a render of the other side: lego agrees with its own mirror image by up to 0.957.
inline constexpr double kSureTogether = 0.98;

/// True if a block that agrees with the field needs to be read no further.
/// @param reading  of the block   @param block  with the parts into which gaps divide it
inline bool is_sure(const ImageReading& reading, const ImageBlock& block) {
  return block.parts.empty() || reading.informed.agreement >= kSureTogether;
}

/// Takes a block in place of the parts found in it, unless one of them agrees better.
/// @param block  that agrees with the field   @param parts  found so far; others than the block's stay
inline void take_unless_better(PartReading block, std::vector<PartReading>& parts) {
  const auto in_block = [&](const PartReading& part) {
    const PixelBox &in = part.box, &out = block.box;
    return in.x >= out.x && in.y >= out.y && in.x + in.width <= out.x + out.width &&
           in.y + in.height <= out.y + out.height;
  };
  const auto better = [&](const PartReading& part) {
    return in_block(part) && part.reading.informed.agreement > block.reading.informed.agreement;
  };
  if (std::ranges::any_of(parts, better)) return;
  std::erase_if(parts, in_block);
  parts.push_back(std::move(block));
}

}  // namespace fieldmark::watermark
