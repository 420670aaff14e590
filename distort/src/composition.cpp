#include "composition.h"
#include <fieldmark/imaging/resize.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
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

// Marks the pixels that are not background; all of them if every pixel is.
std::vector<std::uint8_t> object_of(const Tensor<float>& x, std::span<const float> background) {
  std::vector<std::uint8_t> object;
  for (Index i = 0; i < x.size(); i += 3) object.push_back(!is_background(&x[i], background));
  if (std::ranges::find(object, 1) == object.end()) std::ranges::fill(object, 1);
  return object;
}

// Rows or columns [begin, end).
struct Lines {
  Index begin, end;
  // Leaves out those at the ends without a pixel. At least one has pixels.
  void trim(const std::vector<Index>& pixels) {
    while (pixels[at(begin)] == 0) ++begin;
    while (pixels[at(end - 1)] == 0) --end;
  }
  // Keeps the lines before or after the one at which half of the pixels are reached; a single line stays.
  void halve(const std::vector<Index>& pixels, bool after) {
    if (end - begin < 2) return;
    const Index all = std::accumulate(pixels.begin() + begin, pixels.begin() + end, Index{0});
    Index line = begin;
    for (Index sum = 0; line < end && 2 * sum < all; ++line) sum += pixels[at(line)];
    (after ? begin : end) = std::clamp(line, begin + 1, end - 1);
  }
};

// Counts the pixels of each line within the others: of each row within columns, or the reverse.
std::vector<Index> pixels_of(const std::vector<std::uint8_t>& object, Index width, const Lines& others,
                             bool rows) {
  const Index height = std::ssize(object) / width;
  std::vector<Index> count(at(rows ? height : width));
  for (Index y = 0; y < height; ++y)
    for (Index x = 0; x < width; ++x) {
      const Index line = rows ? y : x, other = rows ? x : y;
      if (other >= others.begin && other < others.end) count[at(line)] += object[at(y * width + x)];
    }
  return count;
}

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

PastedPart quarter_of_object(const Tensor<float>& x, std::span<const float> background, double scale,
                             const std::array<float, 4>& draw) {
  const Index h = x.shape[0], w = x.shape[1];
  const std::vector<std::uint8_t> object = object_of(x, background);
  const int quarter = std::min(3, static_cast<int>(4 * draw[0]));
  Lines rows{0, h}, columns{0, w};
  const auto of_rows = [&] { return pixels_of(object, w, columns, true); };
  const auto of_columns = [&] { return pixels_of(object, w, rows, false); };
  const auto halve_rows = [&] { rows.halve(of_rows(), quarter >= 2); };
  const auto halve_columns = [&] { columns.halve(of_columns(), quarter % 2 == 1); };
  rows.trim(of_rows());
  columns.trim(of_columns());
  if (draw[3] < 0.5f) {
    halve_rows();
    halve_columns();
  } else {
    halve_columns();
    halve_rows();
  }
  rows.trim(of_rows());
  columns.trim(of_columns());
  const auto scaled = [&](const Lines& lines) {
    return std::max<Index>(1, std::llround(scale * static_cast<double>(lines.end - lines.begin)));
  };
  const auto place = [](float u, Index room) {
    return std::min(room, static_cast<Index>(u * static_cast<float>(room + 1)));
  };
  const Index height = scaled(rows), width = scaled(columns);
  return {rows.begin,
          columns.begin,
          rows.end - rows.begin,
          columns.end - columns.begin,
          place(draw[1], h - height),
          place(draw[2], w - width),
          height,
          width};
}

// Colours are scaled together with their cover, so that no background mixes into the edges.
Tensor<float> pasted(const Tensor<float>& x, std::span<const float> background, const PastedPart& part,
                     Tensor<float> onto) {
  const std::vector<std::uint8_t> object = object_of(x, background);
  Tensor<float> colour({part.height, part.width, 3}), cover(colour.shape);
  for (Index p = 0; p < part.height * part.width; ++p) {
    const Index from = (part.top + p / part.width) * x.shape[1] + part.left + p % part.width;
    if (!object[at(from)]) continue;
    std::copy_n(&x[3 * from], 3, &colour[3 * p]);
    std::fill_n(&cover[3 * p], 3, 1.f);
  }
  colour = resize_area(colour, part.to_height, part.to_width);
  cover = resize_area(cover, part.to_height, part.to_width);
  for (Index i = 0; i < colour.size(); ++i) {
    const Index row = i / (3 * part.to_width), column = i % (3 * part.to_width);
    float& pixel = onto[3 * ((part.to_top + row) * onto.shape[1] + part.to_left) + column];
    pixel = colour[i] + (1 - cover[i]) * pixel;
  }
  return onto;
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
