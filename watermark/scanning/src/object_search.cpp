#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/scanning/object_search.h>
#include "outline_match.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace fieldmark::watermark {
namespace {

// Grids of the whole object and of a quarter, pixels of the longer side: a coarse one for all places, a fine
// one for the best of them.
constexpr Index kCoarseWhole = 16, kCoarseQuarter = 12, kFine = 24;
constexpr Index kLeastCoarse = 24, kLeastFine = 60;  // pixels inside an outline: fewer look like anything
// Sizes: the longer side of an object as a share of the image's. The smallest is kSmallest, and each is kStep
// times the one before, with kFinePerSize fine sizes to a step. Quarters count half.
constexpr double kSmallest = 0.2;
constexpr Index kSizes = 8, kFinePerSize = 3;
constexpr double kStep = 1.25;
constexpr Index kReach = 2;  // fine sizes to either side of the coarse one
constexpr Index kShift = 3;  // pixels of the fine grid that a place may move
constexpr std::size_t kRefinedWholes = 64,
                      kRefinedQuarters = 512;  // best coarse places that are compared finely

bool holds(const Window& window, Index x, Index y) {
  const auto right = static_cast<double>(x), down = static_cast<double>(y);
  return right >= window.x && right < window.x + window.width && down >= window.y &&
         down < window.y + window.height;
}

// Returns the smallest window around all pixels of a window inside the outline; empty if there are none.
Window outline_window(const Tensor<float>& opacity, const Window& within) {
  const Index h = opacity.shape[0], w = opacity.shape[1];
  Index left = w, right = 0, top = h, bottom = 0;
  for (Index y = 0; y < h; ++y)
    for (Index x = 0; x < w; ++x) {
      if (!holds(within, x, y) || !(opacity[y * w + x] >= 0.5f)) continue;
      left = std::min(left, x), right = std::max(right, x + 1);
      top = std::min(top, y), bottom = std::max(bottom, y + 1);
    }
  if (right <= left) return {};
  return {static_cast<double>(left), static_cast<double>(top), static_cast<double>(right - left),
          static_cast<double>(bottom - top)};
}

// Returns the row, or the column, at which half of the opacity inside a window is reached.
double middle(const Tensor<float>& opacity, const Window& window, bool row) {
  const Index w = opacity.shape[1];
  std::vector<double> lines(at(opacity.shape[row ? 0 : 1]));
  double all = 0, sum = 0;
  for (Index p = 0; p < opacity.size(); ++p) {
    if (!holds(window, p % w, p / w)) continue;
    lines[at(row ? p / w : p % w)] += static_cast<double>(opacity[p]);
    all += static_cast<double>(opacity[p]);
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    sum += lines[i];
    if (2 * sum >= all) return static_cast<double>(i + 1);
  }
  return static_cast<double>(lines.size());
}

// Returns windows around eight quarters, without margins: those of the object's window, and those with a
// quarter of its pixels each.
std::vector<Window> quarters_of(const Tensor<float>& opacity, const Window& all) {
  const auto split = [&](double row, auto column_of) {
    std::vector<Window> out;
    for (const Window& half : {Window{all.x, all.y, all.width, row - all.y},
                               Window{all.x, row, all.width, all.y + all.height - row}}) {
      const double column = column_of(half);
      out.push_back({half.x, half.y, column - half.x, half.height});
      out.push_back({column, half.y, half.x + half.width - column, half.height});
    }
    return out;
  };
  std::vector<Window> out =
      split(all.y + all.height / 2, [&](const Window&) { return all.x + all.width / 2; });
  for (const Window& quarter :
       split(middle(opacity, all, true), [&](const Window& half) { return middle(opacity, half, false); }))
    out.push_back(quarter);
  for (Window& quarter : out) quarter = outline_window(opacity, quarter);
  std::erase_if(out, [](const Window& quarter) { return !(quarter.width > 0); });
  return out;
}

Window whole_window(const Tensor<float>& image) {
  return {0, 0, static_cast<double>(image.shape[1]), static_cast<double>(image.shape[0])};
}

Tensor<float> in_all_channels(const Tensor<float>& opacity) {
  Tensor<float> out({opacity.shape[0], opacity.shape[1], 3});
  for (Index i = 0; i < out.size(); ++i) out[i] = opacity[i / 3];
  return out;
}

Window window_of(const OutlineMatch& match, const Outline& outline, const ResizedImage& image) {
  return {static_cast<double>(match.column) / image.zoom_x, static_cast<double>(match.row) / image.zoom_y,
          static_cast<double>(outline.width) / image.zoom_x,
          static_cast<double>(outline.height) / image.zoom_y};
}

}  // namespace

// A part of the object in one view.
struct ObjectSearch::Part {
  std::size_t view;
  bool whole;
  Window window;  // in the render
  Outline coarse, fine;
};

// Where the image looks most like a part.
struct ObjectSearch::Found {
  std::size_t part;
  Index size = 0;  // of the coarse grid
  Window window{};
  double likeness = -1;
  void take(const OutlineMatch& match, const Outline& outline, const ResizedImage& image, Index at_size) {
    if (!(match.likeness > likeness)) return;
    *this = {part, at_size, window_of(match, outline, image), match.likeness};
  }
};

// The image at all sizes for one kind of part, whose longer side must have `least` pixels.
class ObjectSearch::Sizes {
 public:
  Sizes(const Tensor<float>& rgb, bool whole, Index least) : least_(static_cast<double>(least)) {
    const double longer = static_cast<double>(std::max(rgb.shape[0], rgb.shape[1])) / (whole ? 1 : 2);
    const auto grid = static_cast<double>(whole ? kCoarseWhole : kCoarseQuarter);
    const auto resized = [&](bool used, double zoom) {
      return used ? resized_image(rgb, zoom) : ResizedImage{};
    };
    for (Index i = 0; i < kSizes; ++i) {
      const double zoom = grid / (size_of(kFinePerSize * i) * longer);
      const bool used = zoom <= 1 && size_of(kFinePerSize * i + kReach) * longer >= least_;
      first_ += !used;
      coarse_.push_back(resized(used, zoom));
    }
    for (Index i = -kReach; i <= kFinePerSize * (kSizes - 1) + kReach; ++i)
      fine_.push_back(resized(first_ < kSizes && i + kReach >= kFinePerSize * first_,
                              static_cast<double>(kFine) / (size_of(i) * longer)));
  }

  // Returns the best place among all of all sizes.
  Found coarse(const Part& part, std::size_t index) const {
    Found found{index};
    for (Index i = first_; i < kSizes; ++i)
      found.take(best_match(part.coarse, coarse_[at(i)]), part.coarse, coarse_[at(i)], i);
    return found;
  }

  // Returns the best place near a coarse one, on the fine grid.
  Found fine(const Part& part, const Found& coarse) const {
    Found found{coarse.part};
    const Window& w = coarse.window;
    for (Index i = 0; i <= 2 * kReach; ++i) {
      const ResizedImage& image = fine_[at(kFinePerSize * coarse.size + i)];
      const Window size = window_of({}, part.fine, image);
      if (std::max(size.width, size.height) < least_) continue;
      const auto start = [](double middle, double zoom, Index length) {
        return std::lround(middle * zoom - static_cast<double>(length) / 2);
      };
      const Index row = start(w.y + w.height / 2, image.zoom_y, part.fine.height),
                  column = start(w.x + w.width / 2, image.zoom_x, part.fine.width);
      found.take(best_match_near(part.fine, image, row, column, kShift), part.fine, image, coarse.size);
    }
    return found;
  }

 private:
  static double size_of(Index fine) {
    return kSmallest * std::pow(kStep, static_cast<double>(fine) / static_cast<double>(kFinePerSize));
  }
  double least_;
  std::vector<ResizedImage> coarse_, fine_;
  Index first_ = 0;  // size from which on the image is no smaller than the grid, and parts than `least`
};

void ObjectSearch::check(const ObjectSearchOptions& options) {
  if (options.views < 1 || options.size < kFine)
    throw ValueError("[object_search] views and size must be at least 1 and 24, got " +
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
    const Window all = outline_window(view.opacity, whole_window(view.opacity));
    if (!(all.width > 0)) continue;
    add_part(v, view.rgb, opacity, all, true);
    for (const Window& quarter : quarters_of(view.opacity, all))
      add_part(v, view.rgb, opacity, quarter, false);
  }
}

ObjectSearch::~ObjectSearch() = default;

void ObjectSearch::add_part(std::size_t view, const Tensor<float>& rgb, const Tensor<float>& opacity,
                            const Window& window, bool whole) {
  auto coarse = outline_of(rgb, opacity, window, whole ? kCoarseWhole : kCoarseQuarter, kLeastCoarse),
       fine = outline_of(rgb, opacity, window, kFine, kLeastFine);
  if (coarse && fine) parts_.push_back({view, whole, window, std::move(*coarse), std::move(*fine)});
}

// Returns the best places of the parts of one kind, the likeliest first.
std::vector<ObjectSearch::Found> ObjectSearch::found(const Tensor<float>& rgb, bool whole,
                                                     Index least) const {
  const Sizes sizes(rgb, whole, least);
  std::vector<Found> all;
  for (std::size_t i = 0; i < parts_.size(); ++i)
    if (parts_[i].whole == whole) all.push_back({i});
  const auto each = [&](auto better) {
    parallel_for(std::ssize(all), 4, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) all[at(i)] = better(parts_[all[at(i)].part], all[at(i)]);
    });
    std::erase_if(all, [](const Found& f) { return !(f.likeness > 0); });
    std::ranges::stable_sort(all, [](const Found& a, const Found& b) { return a.likeness > b.likeness; });
  };
  each([&](const Part& part, const Found& f) { return sizes.coarse(part, f.part); });
  all.resize(std::min(all.size(), whole ? kRefinedWholes : kRefinedQuarters));
  each([&](const Part& part, const Found& f) { return sizes.fine(part, f); });
  return all;
}

std::vector<ObjectPlace> ObjectSearch::find(const Tensor<float>& rgb, const Wanted& wholes,
                                            const Wanted& quarters) const {
  check_rank("object_search", "rgb", rgb.shape, 3, "[height, width, 3]");
  check_extent("object_search", "rgb", rgb.shape, 2, 3, "red, green and blue");
  const Index h = rgb.shape[0], w = rgb.shape[1];
  if (h < kCoarseWhole || w < kCoarseWhole)
    throw ShapeError("[object_search] rgb must have sides of at least 16, got shape " + rgb.shape.str());
  std::vector<ObjectPlace> best;
  for (const bool whole : {true, false}) {
    const auto& [count, least] = whole ? wholes : quarters;
    if (count < 0 || least < 0)
      throw ValueError("[object_search] count and least must be at least 0, got " + std::to_string(count) +
                       " and " + std::to_string(least));
    if (count == 0) continue;
    std::vector<std::uint8_t> used(cameras_.size());
    Index left = count;
    for (const Found& f : found(rgb, whole, least)) {
      const Part& part = parts_[f.part];
      if (std::exchange(used[part.view], 1)) continue;
      best.push_back({camera_at(part, f.window, h, w), f.window, whole, f.likeness});
      if (--left == 0) break;
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
