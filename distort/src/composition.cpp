#include "composition.h"
#include <fieldmark/imaging/resize.h>

#include <algorithm>
#include <cmath>
#include <vector>

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

constexpr Index kLeaves = 600;                           // leave about a fiftieth uncovered
constexpr double kLeastLeaf = 0.02, kLargestLeaf = 0.5;  // radii, of the longer side

struct Leaf {
  double x, y, radius;
  std::array<float, 4> colour;
};

}  // namespace

// The first leaf over a pixel is the uppermost.
Tensor<float> dead_leaves(Index height, Index width, const std::function<std::array<float, 4>(Index)>& draw) {
  const double longer = static_cast<double>(std::max(height, width));
  const double most = 1 / (kLeastLeaf * kLeastLeaf), least = 1 / (kLargestLeaf * kLargestLeaf);
  std::vector<Leaf> leaves;
  for (Index i = 0; i < kLeaves; ++i) {
    const auto place = draw(2 * i);
    const double radius = 1 / std::sqrt(most - static_cast<double>(place[2]) * (most - least));
    leaves.push_back({static_cast<double>(place[0]) * static_cast<double>(width),
                      static_cast<double>(place[1]) * static_cast<double>(height), longer * radius,
                      draw(2 * i + 1)});
  }
  Tensor<float> out({height, width, 3}, 0.5f);
  for (Index p = 0; p < height * width; ++p) {
    const auto over = std::ranges::find_if(leaves, [&](const Leaf& leaf) {
      const double dx = static_cast<double>(p % width) + 0.5 - leaf.x,
                   dy = static_cast<double>(p / width) + 0.5 - leaf.y;
      return dx * dx + dy * dy < leaf.radius * leaf.radius;
    });
    if (over != leaves.end()) std::copy_n(over->colour.begin(), 3, &out[3 * p]);
  }
  return out;
}

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
