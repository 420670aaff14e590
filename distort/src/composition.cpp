#include "composition.h"
#include <fieldmark/imaging/resize.h>

#include <algorithm>

namespace fieldmark::distort {
namespace {

// Copies x into y at a position inside y.
void put(const Tensor<float>& x, Index top, Index left, Tensor<float>& y) {
  for (Index row = 0; row < x.shape[0]; ++row)
    std::copy_n(x.data.begin() + 3 * row * x.shape[1], 3 * x.shape[1],
                y.data.begin() + 3 * ((row + top) * y.shape[1] + left));
}

Tensor<float> on_black(const Tensor<float>& x, Index height, Index width) {
  Tensor<float> out({height, width, 3}, 0.f);
  put(x, (height - x.shape[0]) / 2, (width - x.shape[1]) / 2, out);
  return out;
}

Index share(Index extent, Index part, Index of) { return (extent * part + of / 2) / of; }

}  // namespace

Tensor<float> pillarboxed(const Tensor<float>& x) {
  return on_black(x, x.shape[0], std::max(x.shape[1], share(x.shape[0], 16, 9)));
}

Tensor<float> letterboxed(const Tensor<float>& x) {
  return on_black(x, std::max(x.shape[0], share(x.shape[1], 16, 9)), x.shape[1]);
}

Tensor<float> captioned(const Tensor<float>& x) {
  const Index h = x.shape[0], w = x.shape[1], top = share(h, 2, 5),
              bottom = std::max(top + 1, share(h, 3, 5));
  Tensor<float> y = x;
  const Index line = std::max<Index>(1, (bottom - top) / 7);
  for (Index row = top; row < std::min(bottom, h); ++row)
    for (Index column = 0; column < w; ++column) {
      // Three lines of dashes.
      const bool text =
          (row - top) / line % 2 == 1 && column / line % 3 != 2 && column > w / 8 && column < w - w / 8;
      std::fill_n(y.data.begin() + 3 * (row * w + column), 3, text ? 1.f : 0.f);
    }
  return y;
}

Tensor<float> collage(const Tensor<float>& x) {
  const Index h = x.shape[0], w = x.shape[1], upper = (h + 1) / 2, left = (w + 1) / 2;
  Tensor<float> y(x.shape);
  for (const Index top : {Index{0}, upper})
    for (const Index begin : {Index{0}, left}) {
      const Index height = top == 0 ? upper : h - upper, width = begin == 0 ? left : w - left;
      if (height > 0 && width > 0) put(resize_area(x, height, width), top, begin, y);
    }
  return y;
}

Tensor<float> sepia(const Tensor<float>& x) {
  constexpr float kMatrix[3][3] = {
      {0.393f, 0.769f, 0.189f}, {0.349f, 0.686f, 0.168f}, {0.272f, 0.534f, 0.131f}};
  Tensor<float> y(x.shape);
  for (Index i = 0; i < x.size(); i += 3)
    for (Index c = 0; c < 3; ++c)
      y[i + c] = kMatrix[c][0] * x[i] + kMatrix[c][1] * x[i + 1] + kMatrix[c][2] * x[i + 2];
  return y;
}

}  // namespace fieldmark::distort
