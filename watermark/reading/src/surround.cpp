#include "surround.h"
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/flood_fill.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "cut_out.h"

namespace fieldmark::watermark {
namespace {

using Colour = std::array<float, 3>;

constexpr float kBar = 0.03f;           // in every channel, around a bar's colour: more than JPEG changes
constexpr float kBackground = 0.06f;    // the same for a background
constexpr double kMostOfEdge = 0.5;     // share of the edge pixels that a background has at least
constexpr double kLeastOfImage = 0.03;  // share of all pixels that a background has at least
constexpr double kLeastCover = 0.02, kMostCover = 0.4;  // share of the rows that a bar covers
constexpr Index kLeastSide = 16;                        // least side that bars leave, pixels

bool alike(const float* pixel, const Colour& colour, float tolerance) {
  for (std::size_t a = 0; a < 3; ++a)
    if (!(std::abs(pixel[a] - colour[a]) <= tolerance)) return false;
  return true;
}

// Returns the mean colour of a line of pixels if all have it.
std::optional<Colour> plain_line(const Tensor<float>& image, Index first, Index step, Index count) {
  Colour mean{};
  for (Index i = 0; i < count; ++i)
    for (std::size_t a = 0; a < 3; ++a)
      mean[a] += image[3 * (first + i * step) + static_cast<Index>(a)] / static_cast<float>(count);
  for (Index i = 0; i < count; ++i)
    if (!alike(&image[3 * (first + i * step)], mean, kBar)) return std::nullopt;
  return mean;
}

// Lines at one side with the colour of the first; none if that is the background's.
struct Bar {
  Index lines = 0;
  Colour colour{};
};

template <class Line>
Bar find_bar(Index lines, const Colour& background, Line line) {
  const std::optional<Colour> colour = line(0);
  if (!colour || alike(colour->data(), background, kBackground)) return {};
  Bar bar{1, *colour};
  for (; bar.lines < lines; ++bar.lines) {
    const std::optional<Colour> next = line(bar.lines);
    if (!next || !alike(next->data(), bar.colour, kBar)) break;
  }
  return bar;
}

// Bars come in pairs: a single plain side may be sky.
bool is_pair(const Bar& a, const Bar& b, Index lines) {
  return a.lines > 0 && b.lines > 0 && a.lines + b.lines + kLeastSide <= lines &&
         alike(a.colour.data(), b.colour, kBar);
}

struct Bars {
  Box inside;
  std::optional<Colour> all_around;  // their colour if all four sides have bars that agree
};

Bars find_bars(const Tensor<float>& image, const Colour& background) {
  const Index h = image.shape[0], w = image.shape[1];
  Box box{0, h, 0, w};
  const Bar top = find_bar(h, background, [&](Index i) { return plain_line(image, i * w, 1, w); }),
            bottom =
                find_bar(h, background, [&](Index i) { return plain_line(image, (h - 1 - i) * w, 1, w); });
  const bool rows = is_pair(top, bottom, h);
  if (rows) {
    box.top = top.lines;
    box.bottom = h - bottom.lines;
  }
  const Index begin = box.top * w, count = box.bottom - box.top;
  const Bar left = find_bar(w, background, [&](Index i) { return plain_line(image, begin + i, w, count); }),
            right = find_bar(w, background,
                             [&](Index i) { return plain_line(image, begin + w - 1 - i, w, count); });
  const bool columns = is_pair(left, right, w);
  if (columns) {
    box.left = left.lines;
    box.right = w - right.lines;
  }
  Bars bars{box, std::nullopt};
  if (rows && columns && alike(top.colour.data(), left.colour, kBar)) bars.all_around = top.colour;
  return bars;
}

std::vector<Index> edge_pixels(Index h, Index w) {
  std::vector<Index> edge;
  for (Index x = 0; x < w; ++x) edge.insert(edge.end(), {x, (h - 1) * w + x});
  for (Index y = 1; y + 1 < h; ++y) edge.insert(edge.end(), {y * w, y * w + w - 1});
  return edge;
}

// Returns the colour of most pixels at the edges, if most share one.
std::optional<Colour> edge_colour(const Tensor<float>& image, const std::vector<Index>& edge) {
  const std::size_t stride = std::max<std::size_t>(1, edge.size() / 256);
  std::size_t most = 0;
  Colour best{};
  for (std::size_t i = 0; i < edge.size(); i += stride) {
    const float* of = &image[3 * edge[i]];
    const Colour candidate{of[0], of[1], of[2]};
    const auto count = static_cast<std::size_t>(std::ranges::count_if(
        edge, [&](Index p) { return alike(&image[3 * p], candidate, kBackground / 2); }));
    if (count > most) {
      most = count;
      best = candidate;
    }
  }
  if (static_cast<double>(most) < kMostOfEdge * static_cast<double>(edge.size())) return std::nullopt;
  return best;
}

void replace_background(const std::optional<Colour>& of_bars, const Colour& own, Surround& seen) {
  const Index h = seen.image.shape[0], w = seen.image.shape[1];
  const std::vector<Index> edge = edge_pixels(h, w);
  const std::optional<Colour> colour = of_bars ? of_bars : edge_colour(seen.image, edge);
  if (!colour || alike(colour->data(), own, kBackground)) return;
  const std::vector<Index> behind =
      flood_fill(h, w, edge, [&](Index p) { return alike(&seen.image[3 * p], *colour, kBackground); });
  if (!of_bars && static_cast<double>(behind.size()) < kLeastOfImage * static_cast<double>(h * w)) return;
  seen.plain = seen.image;
  seen.colour = *colour;
  for (const Index p : behind) std::copy_n(own.data(), 3, &seen.image[3 * p]);
}

// Returns the rows that a bar covers: both ends have one colour, the same in all rows, that is not the
// background's.
std::vector<Index> covered_rows(const Tensor<float>& image, const Colour& background) {
  const Index h = image.shape[0], w = image.shape[1];
  std::vector<Index> rows;
  std::optional<Colour> colour;
  for (Index y = 0; y < h; ++y) {
    const float *left = &image.data[at(3 * y * w)], *right = &image.data[at(3 * (y * w + w - 1))];
    const Colour found = colour.value_or(Colour{left[0], left[1], left[2]});
    if (alike(left, background, kBackground) || !alike(left, found, kBar) || !alike(right, found, kBar))
      continue;
    colour = found;
    rows.push_back(y);
  }
  const auto few = static_cast<Index>(kLeastCover * static_cast<double>(h)),
             many = static_cast<Index>(kMostCover * static_cast<double>(h));
  const bool together = !rows.empty() && rows.back() - rows.front() + 1 == std::ssize(rows);
  if (!together || std::ssize(rows) < few || std::ssize(rows) > many) return {};
  return rows;
}

void clear_cover(const Colour& background, Surround& seen) {
  const Index w = seen.image.shape[1];
  const std::vector<Index> rows = covered_rows(seen.image, background);
  if (rows.empty()) return;
  seen.covered.assign(at(seen.image.size() / 3), 0);
  for (const Index y : rows)
    for (Index p = y * w; p < (y + 1) * w; ++p) {
      seen.covered[at(p)] = 1;
      std::copy_n(background.data(), 3, &seen.image[3 * p]);
    }
}

}  // namespace

Surround clear_surround(const Tensor<float>& image, float background, bool object) {
  check_rank("clear_surround", "image", image.shape, 3, "[H, W, 3]");
  check_extent("clear_surround", "image", image.shape, 2, 3, "red, green, blue");
  const Colour own{background, background, background};
  const Bars bars = find_bars(image, own);
  Surround out{
      .image = cut_out(image, bars.inside), .plain = {}, .left = bars.inside.left, .top = bars.inside.top};
  if (!object) return out;
  replace_background(bars.all_around, own, out);
  clear_cover(own, out);
  return out;
}

Tensor<float> before_background(const Tensor<float>& image, const Tensor<float>& opacity,
                                const std::array<float, 3>& from, const std::array<float, 3>& to) {
  check_rank("before_background", "image", image.shape, 3, "[H, W, 3]");
  if (opacity.size() * 3 != image.size())
    throw ShapeError("[before_background] opacity must have a number for each of " +
                     std::to_string(image.size() / 3) + " pixels, got " + std::to_string(opacity.size()));
  Tensor<float> out = image;
  for (Index i = 0; i < out.size(); ++i) {
    const auto c = static_cast<std::size_t>(i % 3);
    out[i] += (1 - opacity[i / 3]) * (to[c] - from[c]);
  }
  return out;
}

}  // namespace fieldmark::watermark
