#include "scene_look.h"

#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/flood_fill.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "checks.h"
#include "silhouettes.h"

namespace fieldmark::nerf {
namespace {

using Colour = std::array<float, 3>;

constexpr float kSeeThrough = 0.5f;    // alpha below which a pixel is transparent
constexpr double kObjectBorder = 0.5;  // transparent share of the borders of an object's images
constexpr float kOneColour = 0.06f;    // largest deviation of a plain border in a channel: JPEG, soft light
constexpr float kExact = 1.5f / 255;   // smallest tolerance: rounding
constexpr float kSameColour = 0.1f;    // between the borders of two images
constexpr double kPlainBorder = 0.8, kPlainViews = 0.9;  // shares of pixels and of images
constexpr double kFrameFill = 0.95, kFrameDisc = 0.75;   // opaque share of a frame's rectangle
constexpr double kFrameArea = 0.45, kFrameShift = 0.03;  // of an image, and of its sides
constexpr double kFrameViews = 0.9;

// The bounding rectangle of the marked pixels of an image, relative to its sides.
struct Extent {
  std::array<double, 4> box{};  // left, top, right, bottom
  double fill = 0;              // marked share of the rectangle; 0: no pixel is marked
  double area() const { return (box[2] - box[0]) * (box[3] - box[1]); }
};

using Marked = std::function<bool(const float* rgba)>;

Extent extent_of(const View& view, const Marked& marked) {
  const Index height = view.rgba.shape[0], width = view.rgba.shape[1];
  Index left = width, top = height, right = 0, bottom = 0, count = 0;
  for (Index y = 0; y < height; ++y)
    for (Index x = 0; x < width; ++x) {
      if (!marked(view.rgba.data.data() + 4 * (y * width + x))) continue;
      left = std::min(left, x), right = std::max(right, x + 1);
      top = std::min(top, y), bottom = std::max(bottom, y + 1);
      ++count;
    }
  if (count == 0) return {};
  const double w = static_cast<double>(width), h = static_cast<double>(height);
  return {.box = {static_cast<double>(left) / w, static_cast<double>(top) / h, static_cast<double>(right) / w,
                  static_cast<double>(bottom) / h},
          .fill = static_cast<double>(count) / static_cast<double>((right - left) * (bottom - top))};
}

template <class T>
T middle_of(std::vector<T> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Returns true if the marked pixels are the same rectangle or disc in nearly all images: the inside of a
// frame. An object's silhouette has another outline, or is small.
bool is_framed(std::span<const View> views, const Marked& marked) {
  std::vector<Extent> extents(views.size());
  parallel_for(std::ssize(views), 1,
               [&](Index v, Index) { extents[at(v)] = extent_of(views[at(v)], marked); });
  std::array<double, 4> usual{};
  for (std::size_t side = 0; side < 4; ++side) {
    std::vector<double> all;
    for (const Extent& e : extents) all.push_back(e.box[side]);
    usual[side] = middle_of(all);
  }
  const auto framed = std::count_if(extents.begin(), extents.end(), [&](const Extent& e) {
    double shift = 0, from_image = 0;
    for (std::size_t side = 0; side < 4; ++side) {
      shift = std::max(shift, std::abs(e.box[side] - usual[side]));
      from_image = std::max(from_image, std::abs(e.box[side] - (side < 2 ? 0 : 1)));
    }
    const double least = from_image <= kFrameShift ? kFrameDisc : kFrameFill;
    return e.fill >= least && e.area() >= kFrameArea && shift <= kFrameShift;
  });
  return static_cast<double>(framed) >= kFrameViews * static_cast<double>(views.size());
}

// Calls visit(pixel) for each pixel of an image's outermost ring.
template <class F>
void visit_border(Index width, Index height, F visit) {
  for (Index x = 0; x < width; ++x) {
    visit(x);
    if (height > 1) visit((height - 1) * width + x);
  }
  for (Index y = 1; y + 1 < height; ++y) {
    visit(y * width);
    if (width > 1) visit(y * width + width - 1);
  }
}

float stray(const float* rgb, const Colour& colour) {
  float most = 0;
  for (std::size_t k = 0; k < 3; ++k) most = std::max(most, std::abs(rgb[k] - colour[k]));
  return most;
}

struct Borders {
  Colour colour{};         // the usual one
  float tolerance = 0;     // covers 99 of 100 plain pixels
  double transparent = 0;  // share of all border pixels
  double plain = 0;        // share of images whose border has the usual colour
};

Borders borders_of(std::span<const View> views) {
  std::vector<Colour> colours(views.size());
  Index pixels = 0, transparent = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Tensor<float>& rgba = views[v].rgba;
    std::array<std::vector<float>, 3> channels;
    visit_border(rgba.shape[1], rgba.shape[0], [&](Index p) {
      if (!is_valid(views[v], p)) return;
      for (std::size_t k = 0; k < 3; ++k) channels[k].push_back(rgba[4 * p + static_cast<Index>(k)]);
      transparent += rgba[4 * p + 3] < kSeeThrough;
      ++pixels;
    });
    if (channels[0].empty()) continue;
    for (std::size_t k = 0; k < 3; ++k) colours[v][k] = middle_of(std::move(channels[k]));
  }
  Borders found{.transparent =
                    static_cast<double>(transparent) / static_cast<double>(std::max<Index>(pixels, 1))};
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<float> all;
    for (const Colour& c : colours) all.push_back(c[k]);
    found.colour[k] = middle_of(std::move(all));
  }
  std::vector<float> strays;
  Index plain = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Tensor<float>& rgba = views[v].rgba;
    Index near = 0, all = 0;
    visit_border(rgba.shape[1], rgba.shape[0], [&](Index p) {
      if (!is_valid(views[v], p)) return;
      const float own = stray(&rgba.data[at(4 * p)], colours[v]);
      ++all;
      if (own > kOneColour) return;
      ++near;
      strays.push_back(stray(&rgba.data[at(4 * p)], found.colour));
    });
    plain += all > 0 && static_cast<double>(near) >= kPlainBorder * static_cast<double>(all) &&
             stray(colours[v].data(), found.colour) <= kSameColour;
  }
  found.plain = static_cast<double>(plain) / static_cast<double>(views.size());
  if (!strays.empty()) {
    const auto most = strays.begin() + std::ssize(strays) * 99 / 100;
    std::nth_element(strays.begin(), most, strays.end());
    found.tolerance = std::clamp(1.5f * *most, kExact, kOneColour);
  }
  return found;
}

bool is_opaque(const View& view) {
  for (Index i = 3; i < view.rgba.size(); i += 4)
    if (view.rgba[i] < 1) return false;
  return true;
}

std::string percent(double share) { return std::to_string(std::lround(100 * share)) + "%"; }

}  // namespace

SceneLook look_at_scene(std::span<const View> views, bool forward_facing) {
  const Borders borders = borders_of(views);
  SceneLook look{.colour = borders.colour, .tolerance = borders.tolerance};
  const std::string seen =
      percent(borders.transparent) + " of the pixels at the images' borders are transparent";
  const auto is = [&](SceneType type, std::string reason) {
    look.type = type;
    look.reason = std::move(reason);
    return look;
  };
  if (forward_facing) return is(SceneType::forward, "all cameras look one way");
  if (borders.transparent >= kObjectBorder) {
    if (!is_framed(views, [](const float* p) { return p[3] >= kSeeThrough; }))
      return is(SceneType::object, seen);
    return is(SceneType::place, "alpha is a frame, the same around all images");
  }
  if (!std::all_of(views.begin(), views.end(), is_opaque))
    return is(SceneType::place, "alpha is no silhouette: only " + seen);
  if (borders.plain < kPlainViews)
    return is(SceneType::place, "the images are opaque, and their borders have several colours");
  if (is_framed(views, [&](const float* p) { return stray(p, look.colour) > look.tolerance; }))
    return is(SceneType::place, "a frame of one colour is around all images");
  char colour[80];
  std::snprintf(colour, sizeof colour, "the images' borders have one colour, %.0f %.0f %.0f",
                255 * static_cast<double>(look.colour[0]), 255 * static_cast<double>(look.colour[1]),
                255 * static_cast<double>(look.colour[2]));
  return is(SceneType::plain, colour);
}

void cut_out(View& view, const std::array<float, 3>& colour, float tolerance) {
  const Index height = view.rgba.shape[0], width = view.rgba.shape[1];
  // Pixels whose whole neighbourhood has the colour: a fill through them does not leak where a highlight
  // interrupts an edge, and keeps away from edges.
  std::vector<std::uint8_t> far(at(width * height)), clear(at(width * height), 1);
  for (Index p = 0; p < width * height; ++p)
    far[at(p)] = stray(&view.rgba.data[at(4 * p)], colour) > tolerance;
  for (Index p = 0; p < width * height; ++p) {
    if (!far[at(p)]) continue;
    const Index x = p % width, y = p / width;
    for (Index v = std::max<Index>(y - 1, 0); v <= std::min(y + 1, height - 1); ++v)
      for (Index u = std::max<Index>(x - 1, 0); u <= std::min(x + 1, width - 1); ++u)
        clear[at(v * width + u)] = 0;
  }
  std::vector<Index> border;
  visit_border(width, height, [&](Index p) { border.push_back(p); });
  const auto is_clear = [&](Index p) { return clear[at(p)] != 0; };
  for (const Index p : flood_fill(height, width, border, is_clear, Neighbours::eight))
    view.rgba[4 * p + 3] = 0;
}

namespace {

// Marks transparent pixels invalid: what an image of a place does not show is unknown, not empty.
void leave_out_transparent(View& view) {
  if (is_opaque(view)) return;
  if (view.valid.empty()) view.valid.assign(view.rgba.data.size() / 4, 1);
  for (std::size_t p = 0; p < view.valid.size(); ++p)
    if (view.rgba.data[4 * p + 3] < 1) view.valid[p] = 0;
}

}  // namespace

void settle_scene(Dataset& data, const DatasetOptions& options, bool forward_facing) {
  const SceneLook look = look_at_scene(data.views, forward_facing);
  data.scene = options.scene.value_or(look.type);
  data.scene_reason = options.scene ? "as asked for" : look.reason;
  const bool plain = data.scene == SceneType::plain;
  if (data.scene == SceneType::forward && !forward_facing)
    throw ValueError(
        "[load_dataset] scene must not be forward (needs poses_bounds.npy, and cameras within 60 "
        "degrees of their mean axis), got forward; place fits any cameras");
  if (plain && !std::all_of(data.views.begin(), data.views.end(), is_opaque))
    throw ValueError(
        "[load_dataset] scene must not be plain (the images have alpha), got plain; object takes "
        "the silhouettes from alpha");
  const float grey = (look.colour[0] + look.colour[1] + look.colour[2]) / 3;
  const bool white = data.scene == SceneType::object ? data.layout == Layout::blender : plain && grey > 0.5f;
  data.background = options.background.value_or(white ? Background::white : Background::black);
  if (data.scene == SceneType::place)
    for (View& view : data.views) leave_out_transparent(view);
  if (!plain) return;
  data.plain_colour = look.colour;
  const float tolerance = look.type == SceneType::plain ? look.tolerance : kOneColour;
  parallel_for(std::ssize(data.views), 1,
               [&](Index v, Index) { cut_out(data.views[at(v)], look.colour, tolerance); });
}

}  // namespace fieldmark::nerf
