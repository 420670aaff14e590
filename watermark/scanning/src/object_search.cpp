#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/scanning/object_search.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace fieldmark::watermark {
namespace {

constexpr Index kGrid = 16, kQuarterGrid = 12;  // pixels of the longer side of an object, and of a quarter
constexpr float kInside = 0.9f;                 // least opacity inside the outline
// Mean square of what differs from the mean: a plain place looks like nothing.
constexpr float kLeastPower = 1e-3f;
constexpr Index kLeastPixels = 40;  // of an outline: fewer look like anything
// Longer side of an object as a share of the image's. A quarter is half as long.
constexpr std::array kSizes{0.2, 0.25, 0.31, 0.39, 0.49, 0.61, 0.76, 0.95};

// Returns the smallest window around all pixels inside the outline; empty if there are none.
Window outline_window(const Tensor<float>& opacity) {
  const Index h = opacity.shape[0], w = opacity.shape[1];
  Index left = w, right = 0, top = h, bottom = 0;
  for (Index y = 0; y < h; ++y)
    for (Index x = 0; x < w; ++x) {
      if (!(opacity[y * w + x] >= 0.5f)) continue;
      left = std::min(left, x), right = std::max(right, x + 1);
      top = std::min(top, y), bottom = std::max(bottom, y + 1);
    }
  if (right <= left) return {};
  return {static_cast<double>(left), static_cast<double>(top), static_cast<double>(right - left),
          static_cast<double>(bottom - top)};
}

Tensor<float> in_all_channels(const Tensor<float>& opacity) {
  Tensor<float> out({opacity.shape[0], opacity.shape[1], 3});
  for (Index i = 0; i < out.size(); ++i) out[i] = opacity[i / 3];
  return out;
}

}  // namespace

// The image at one of the sizes.
struct ObjectSearch::Reduced {
  Index height, width;
  double zoom_x, zoom_y;        // reduced pixels per pixel
  std::vector<float> plane[3];  // colours
  std::vector<float> squares;   // sum of the squares of all channels
};

void ObjectSearch::check(const ObjectSearchOptions& options) {
  if (options.views < 1 || options.size < kGrid)
    throw ValueError("[object_search] views and size must be at least 1 and 16, got " +
                     std::to_string(options.views) + " and " + std::to_string(options.size));
}

ObjectSearch::ObjectSearch(const Owner& owner, const ObjectSearchOptions& options) {
  if (owner.field.space.kind != nerf::SpaceKind::cube)
    throw ValueError("[object_search] field must show an object, got one that fills its images");
  check(options);
  nerf::Renderer renderer(owner.field, {.finer = 0.75f});  // pixels are large
  cameras_ = nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, options.views, options.size,
                                options.seed);
  for (std::size_t v = 0; v < cameras_.size(); ++v) {
    const nerf::Rendering view = renderer.render(cameras_[v]);
    const Tensor<float> opacity = in_all_channels(view.opacity);
    const Window all = outline_window(view.opacity);
    if (!(all.width > 0)) continue;
    add_part(v, view.rgb, opacity, all, true);
    for (const double down : {0., 0.5})
      for (const double right : {0., 0.5})
        add_part(v, view.rgb, opacity,
                 {all.x + right * all.width, all.y + down * all.height, all.width / 2, all.height / 2},
                 false);
  }
}

void ObjectSearch::add_part(std::size_t view, const Tensor<float>& rgb, const Tensor<float>& opacity,
                            const Window& window, bool whole) {
  const double zoom =
      static_cast<double>(whole ? kGrid : kQuarterGrid) / std::max(window.width, window.height);
  const auto side = [&](double length) { return std::max<Index>(1, std::lround(zoom * length)); };
  Part part{view, whole, window, side(window.height), side(window.width), {}, {}, {}};
  const PatchSize size{part.height, part.width};
  const Tensor<float> colour = cut_window(rgb, window, size, 0),
                      inside = cut_window(opacity, window, size, 0);
  for (Index p = 0; p < part.height * part.width; ++p) {
    if (!(inside[3 * p] >= kInside)) continue;
    part.y.push_back(p / part.width);
    part.x.push_back(p % part.width);
    for (Index c = 0; c < 3; ++c) part.of_mean[c].push_back(colour[3 * p + c]);
  }
  const auto n = static_cast<float>(part.x.size());
  if (std::ssize(part.x) < kLeastPixels) return;
  float power = 0;
  for (auto& channel : part.of_mean) {
    float mean = 0;
    for (const float t : channel) mean += t / n;
    for (float& t : channel) t -= mean, power += t * t;
  }
  if (!(power > kLeastPower * n)) return;
  for (auto& channel : part.of_mean)
    for (float& t : channel) t /= std::sqrt(power);
  parts_.push_back(std::move(part));
}

// The sums over the outline are taken for all places of a row at once.
ObjectPlace ObjectSearch::best_place(const Part& part, const Reduced& image) {
  ObjectPlace best;
  const Index rows = image.height - part.height + 1, columns = image.width - part.width + 1;
  if (rows < 1 || columns < 1) return best;
  const auto n = static_cast<float>(part.x.size());
  const auto m = static_cast<std::size_t>(columns);
  std::vector<float> product(m), square(m),
      mean[3] = {std::vector<float>(m), std::vector<float>(m), std::vector<float>(m)};
  for (Index row = 0; row < rows; ++row) {
    for (auto* sums : {&product, &square, &mean[0], &mean[1], &mean[2]}) std::ranges::fill(*sums, 0.f);
    for (std::size_t k = 0; k < part.x.size(); ++k) {
      const Index from = (row + part.y[k]) * image.width + part.x[k];
      const float* squares = image.squares.data() + from;
      for (std::size_t i = 0; i < m; ++i) square[i] += squares[i];
      for (std::size_t c = 0; c < 3; ++c) {
        const float* plane = image.plane[c].data() + from;
        const float t = part.of_mean[c][k];
        float* sums = mean[c].data();
        for (std::size_t i = 0; i < m; ++i) {
          product[i] += t * plane[i];
          sums[i] += plane[i];
        }
      }
    }
    for (std::size_t i = 0; i < m; ++i) {
      float power = square[i];
      for (const auto& sums : mean) power -= sums[i] * sums[i] / n;
      if (!(power > kLeastPower * n)) continue;
      const double likeness = static_cast<double>(product[i] / std::sqrt(power));
      if (likeness <= best.likeness) continue;
      best.likeness = likeness;
      best.whole = part.whole;
      best.window = {static_cast<double>(i) / image.zoom_x, static_cast<double>(row) / image.zoom_y,
                     static_cast<double>(part.width) / image.zoom_x,
                     static_cast<double>(part.height) / image.zoom_y};
    }
  }
  return best;
}

std::vector<ObjectSearch::Reduced> ObjectSearch::reduced(const Tensor<float>& rgb, bool whole) {
  const Index h = rgb.shape[0], w = rgb.shape[1];
  const double grid = static_cast<double>(whole ? kGrid : 2 * kQuarterGrid);
  std::vector<Reduced> sizes;
  for (const double size : kSizes) {
    const double zoom = grid / (size * static_cast<double>(std::max(h, w)));
    if (zoom > 1) continue;
    const auto side = [&](Index length) {
      return std::max<Index>(1, std::lround(zoom * static_cast<double>(length)));
    };
    const Tensor<float> small = resize_area(rgb, side(h), side(w));
    Reduced next{small.shape[0],
                 small.shape[1],
                 static_cast<double>(small.shape[1]) / static_cast<double>(w),
                 static_cast<double>(small.shape[0]) / static_cast<double>(h),
                 {},
                 {}};
    for (Index p = 0; p < next.height * next.width; ++p) {
      float squares = 0;
      for (Index c = 0; c < 3; ++c) {
        next.plane[c].push_back(small[3 * p + c]);
        squares += small[3 * p + c] * small[3 * p + c];
      }
      next.squares.push_back(squares);
    }
    sizes.push_back(std::move(next));
  }
  return sizes;
}

std::vector<ObjectPlace> ObjectSearch::find(const Tensor<float>& rgb, Index count) const {
  check_rank("object_search", "rgb", rgb.shape, 3, "[height, width, 3]");
  check_extent("object_search", "rgb", rgb.shape, 2, 3, "red, green and blue");
  const Index h = rgb.shape[0], w = rgb.shape[1];
  if (h < kGrid || w < kGrid)
    throw ShapeError("[object_search] rgb must have sides of at least 16, got shape " + rgb.shape.str());
  const std::vector<Reduced> of_whole = reduced(rgb, true), of_quarter = reduced(rgb, false);
  std::vector<ObjectPlace> of_part(parts_.size());
  parallel_for(std::ssize(parts_), 4, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const auto at = static_cast<std::size_t>(i);
      for (const Reduced& image : parts_[at].whole ? of_whole : of_quarter) {
        const ObjectPlace found = best_place(parts_[at], image);
        if (found.likeness > of_part[at].likeness) of_part[at] = found;
      }
    }
  });
  std::vector<std::size_t> order(parts_.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::stable_sort(
      order, [&](std::size_t a, std::size_t b) { return of_part[a].likeness > of_part[b].likeness; });
  std::vector<ObjectPlace> best;
  for (const bool whole : {true, false}) {
    std::vector<std::uint8_t> used(cameras_.size());
    Index taken = 0;
    for (const std::size_t i : order) {
      const Part& part = parts_[i];
      if (taken == count || !(of_part[i].likeness > 0)) break;
      if (part.whole != whole || used[part.view]) continue;
      used[part.view] = 1;
      ++taken;
      best.push_back(of_part[i]);
      best.back().camera = camera_at(part, of_part[i].window, h, w);
    }
  }
  return best;
}

// The window of the part in the image is the part's window in the render.
nerf::Camera ObjectSearch::camera_at(const Part& part, const Window& window, Index height,
                                     Index width) const {
  // The grid's longer side is exact, the other one is rounded.
  const bool wide = part.window.width >= part.window.height;
  const double zoom = wide ? window.width / part.window.width : window.height / part.window.height;
  const Window whole{part.window.x - window.x / zoom, part.window.y - window.y / zoom,
                     static_cast<double>(width) / zoom, static_cast<double>(height) / zoom};
  return window_camera(cameras_[part.view], whole, {height, width});
}

}  // namespace fieldmark::watermark
