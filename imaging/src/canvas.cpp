#include <fieldmark/core/error.h>
#include <fieldmark/imaging/canvas.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wold-style-cast"
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_easy_font.h>
#pragma GCC diagnostic pop

namespace fieldmark {
namespace {

constexpr Index kMostSide = 16384;

// Returns the characters that stb's font supports, mutable and null-terminated as stb requires.
std::vector<char> printable(std::string_view text) {
  std::vector<char> out;
  for (const char c : text) out.push_back(c >= ' ' && c <= '~' ? c : '?');
  out.push_back('\0');
  return out;
}

// A vertex of stb's quads.
struct Vertex {
  float x, y, z;
  unsigned char colour[4];
};

Index checked_side(const char* name, Index side) {
  if (side < 1 || side > kMostSide)
    throw ValueError("[canvas] " + std::string(name) + " must be 1 to 16384 pixels, got " +
                     std::to_string(side));
  return side;
}

}  // namespace

Canvas::Canvas(Index height, Index width)
    : image_(Shape{checked_side("height", height), checked_side("width", width), 3}, 1.0f) {}

void Canvas::cover(Index x, Index y, double share, const Ink& ink) {
  float* pixel = &image_[3 * (y * image_.shape[1] + x)];
  const auto s = static_cast<float>(share);
  for (std::size_t k = 0; k < 3; ++k) pixel[k] += s * (ink[k] - pixel[k]);
}

void Canvas::line(const CanvasPoint& from, const CanvasPoint& to, double thickness, const Ink& ink) {
  const double reach = 0.5 * thickness + 0.5, dx = to.x - from.x, dy = to.y - from.y,
               length2 = dx * dx + dy * dy;
  if (!std::isfinite(length2 + from.x + from.y) || !std::isfinite(thickness)) return;
  const auto pixels = [&](double a, double b, Index side) {
    const double most = static_cast<double>(side);
    return std::pair{static_cast<Index>(std::clamp(std::floor(std::min(a, b) - reach), 0., most)),
                     static_cast<Index>(std::clamp(std::ceil(std::max(a, b) + reach), 0., most))};
  };
  const auto [left, right] = pixels(from.x, to.x, image_.shape[1]);
  const auto [top, bottom] = pixels(from.y, to.y, image_.shape[0]);
  for (Index y = top; y < bottom; ++y)
    for (Index x = left; x < right; ++x) {
      const double u = static_cast<double>(x) + 0.5 - from.x, v = static_cast<double>(y) + 0.5 - from.y;
      const double t = length2 > 0 ? std::clamp((u * dx + v * dy) / length2, 0., 1.) : 0;
      const double share = std::min(reach - std::hypot(u - t * dx, v - t * dy), 1.);
      if (share > 0) cover(x, y, share, ink);
    }
}

void Canvas::text(const CanvasPoint& corner, std::string_view text, int scale, const Ink& ink) {
  std::vector<char> letters = printable(text);
  constexpr std::size_t kStrokes = 32;  // per letter, more than any has; four vertices each
  std::vector<Vertex> vertices(4 * kStrokes * letters.size());
  const int quads = stb_easy_font_print(0, 0, letters.data(), nullptr, vertices.data(),
                                        static_cast<int>(vertices.size() * sizeof(Vertex)));
  const Index left = std::lround(corner.x), top = std::lround(corner.y);
  for (std::size_t q = 0; q < static_cast<std::size_t>(quads); ++q) {
    const Vertex &a = vertices[4 * q], &b = vertices[4 * q + 2];
    const auto pixels = [&](Index from, float stroke, Index side) {
      return std::clamp<Index>(from + scale * std::lround(stroke), 0, side);
    };
    for (Index y = pixels(top, a.y, image_.shape[0]); y < pixels(top, b.y, image_.shape[0]); ++y)
      for (Index x = pixels(left, a.x, image_.shape[1]); x < pixels(left, b.x, image_.shape[1]); ++x)
        cover(x, y, 1, ink);
  }
}

Index Canvas::text_width(std::string_view text, int scale) {
  return Index{scale} * stb_easy_font_width(printable(text).data());
}

}  // namespace fieldmark
