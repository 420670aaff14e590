#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/watermark/mark/object_window.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace fieldmark::watermark {
namespace {

constexpr float kStandsOut = 0.08f;
constexpr Index kReach = 2;          // of the 5 x 5 mean
constexpr double kMargin = 0.04;     // on each side, as a share of the object's longer side
constexpr double kFull = 0.98;       // share of both sides: from here on, there is no plain background
constexpr Index kLargestWhole = 16;  // times the patch's height: above, a window is cut by columns
constexpr Index kColumns = 64;

// Averages up to 2 kReach + 1 neighbours along one axis.
std::vector<float> box_mean(const std::vector<float>& x, Index lines, Index length, Index line, Index step) {
  std::vector<float> out(x.size());
  for (Index l = 0; l < lines; ++l)
    for (Index i = 0; i < length; ++i) {
      const Index from = std::max<Index>(0, i - kReach), to = std::min(length, i + kReach + 1);
      float sum = 0;
      for (Index j = from; j < to; ++j) sum += x[static_cast<std::size_t>(l * line + j * step)];
      out[static_cast<std::size_t>(l * line + i * step)] = sum / static_cast<float>(to - from);
    }
  return out;
}

// Cuts a rectangle out; pixels outside the image are background.
Tensor<float> pixels_around(const Tensor<float>& rgb, Index left, Index top, Index height, Index width,
                            float background) {
  const Index h = rgb.shape[0], w = rgb.shape[1];
  Tensor<float> part({height, width, 3}, background);
  for (Index y = std::max<Index>(0, -top); y < std::min(height, h - top); ++y)
    for (Index x = std::max<Index>(0, -left); x < std::min(width, w - left); ++x)
      for (Index c = 0; c < 3; ++c) part[(y * width + x) * 3 + c] = rgb[((y + top) * w + x + left) * 3 + c];
  return part;
}

}  // namespace

Window object_window(const Tensor<float>& rgb, float background, double aspect) {
  check_rank("object_window", "rgb", rgb.shape, 3, "[H, W, 3]");
  check_extent("object_window", "rgb", rgb.shape, 2, 3, "red, green, blue");
  if (!(aspect > 0)) throw ValueError("[object_window] aspect must be positive, got " + number_text(aspect));
  const Index h = rgb.shape[0], w = rgb.shape[1];
  std::vector<float> distance(static_cast<std::size_t>(h * w));
  for (Index p = 0; p < h * w; ++p)
    for (Index c = 0; c < 3; ++c)
      distance[static_cast<std::size_t>(p)] += std::abs(rgb[3 * p + c] - background) / 3;
  distance = box_mean(box_mean(distance, h, w, w, 1), w, h, 1, w);
  Index x0 = w, x1 = 0, y0 = h, y1 = 0;
  for (Index y = 0; y < h; ++y)
    for (Index x = 0; x < w; ++x)
      if (distance[static_cast<std::size_t>(y * w + x)] > kStandsOut) {
        x0 = std::min(x0, x);
        x1 = std::max(x1, x + 1);
        y0 = std::min(y0, y);
        y1 = std::max(y1, y + 1);
      }
  const auto full = [](Index extent, Index of) {
    return static_cast<double>(extent) >= kFull * static_cast<double>(of);
  };
  if (x0 >= x1 || (full(x1 - x0, w) && full(y1 - y0, h))) x0 = y0 = 0, x1 = w, y1 = h;
  const double margin = x1 - x0 == w && y1 - y0 == h ? 0 : kMargin;
  const double height =
      std::max(static_cast<double>(x1 - x0) / aspect, static_cast<double>(y1 - y0)) * (1 + 2 * margin);
  const double width = height * aspect;
  return {0.5 * (static_cast<double>(x0 + x1) - width), 0.5 * (static_cast<double>(y0 + y1) - height), width,
          height};
}

Tensor<float> cut_window(const Tensor<float>& rgb, const Window& window, const PatchSize& size,
                         float background) {
  if (!(window.width > 0 && window.height > 0) || size.width < 1 || size.height < 1)
    throw ValueError("[cut_window] window and size must be positive, got " + number_text(window.width) +
                     " x " + number_text(window.height) + " and " + std::to_string(size.width) + " x " +
                     std::to_string(size.height));
  // Rounds the window to whole pixels, cuts it out and resizes it once.
  const auto whole = [](double extent) { return std::max<Index>(1, std::lround(extent)); };
  const Index height = whole(window.height), width = whole(window.width);
  const Index left = std::lround(window.x), top = std::lround(window.y);
  if (height <= kLargestWhole * size.height) {
    const Tensor<float> part = pixels_around(rgb, left, top, height, width, background);
    if (height == size.height && width == size.width) return part;
    return height > size.height ? resize_area(part, size.height, size.width)
                                : resize_bilinear(part, size.height, size.width);
  }
  // The window of a very wide or tall image is far larger than the image. Columns shrink independently, so a
  // few at a time give the same bits.
  Tensor<float> rows({size.height, width, 3});
  for (Index begin = 0; begin < width; begin += kColumns) {
    const Index columns = std::min(kColumns, width - begin);
    const Tensor<float> part = pixels_around(rgb, left + begin, top, height, columns, background);
    paste(rows, resize_area(part, size.height, columns), 0, begin);
  }
  return resize_area(rows, size.height, size.width);
}

nerf::Camera window_camera(const nerf::Camera& camera, const Window& window, const PatchSize& size) {
  nerf::Camera out = camera;
  const double zoom_x = static_cast<double>(size.width) / window.width,
               zoom_y = static_cast<double>(size.height) / window.height;
  out.fx *= zoom_x;
  out.fy *= zoom_y;
  out.cx = (camera.cx - window.x) * zoom_x;
  out.cy = (camera.cy - window.y) * zoom_y;
  out.width = size.width;
  out.height = size.height;
  return out;
}

}  // namespace fieldmark::watermark
