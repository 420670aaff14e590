#pragma once
#include <fieldmark/engine/tensor.h>

#include <algorithm>

namespace fieldmark::watermark {

/// Rows [top, bottom) and columns [left, right) of an image, pixels.
struct Box {
  Index top, bottom, left, right;
};

/// Returns a part of an image [H, W, 3].   @param box  within it, or empty: an end that is not beyond its
/// start
inline Tensor<float> cut_out(const Tensor<float>& image, const Box& box) {
  const Index w = image.shape[1], rows = std::max<Index>(0, box.bottom - box.top),
              columns = std::max<Index>(0, box.right - box.left);
  Tensor<float> out({rows, columns, 3});
  for (Index y = 0; columns > 0 && y < rows; ++y)
    std::copy_n(image.data.begin() + 3 * ((box.top + y) * w + box.left), 3 * columns,
                out.data.begin() + 3 * y * columns);
  return out;
}

}  // namespace fieldmark::watermark
