#pragma once
#include <fieldmark/engine/shape.h>
#include <fieldmark/engine/shape_checks.h>

#include <cstdio>
#include <string>
#include <string_view>

namespace fieldmark::distort {

inline void check_image(std::string_view op, const Shape& x) {
  check_rank(op, "x", x, 3, "[height, width, channels]");
}

// Checks that a distortion's parameter has `count` elements; it is a tensor so that gradients reach it.
inline void check_parameter(std::string_view op, std::string_view name, const Shape& got, Index count) {
  if (got.rank() == 1 && got[0] == count) return;  // before the texts, which allocate
  const std::string layout = "[" + std::to_string(count) + "]";
  check_rank(op, name, got, 1, layout);
  check_extent(op, name, got, 0, count, "its layout is " + layout);
}

inline void check_colours(const std::string& op, const Shape& image) {
  check_rank(op, "image", image, 3, "[height, width, 3]");
  check_extent(op, "image", image, 2, 3, "red, green and blue");
  if (image.size() == 0)
    throw ShapeError("[" + op + "] image: must have at least one pixel, got shape " + image.str());
}

// Throws "[op] arg: must be in 0 to 1 (why), got 2". NaN fails.
inline void check_range(std::string_view op, std::string_view arg, double value, double low, double high,
                        std::string_view why) {
  if (value >= low && value <= high) return;
  char numbers[3][32];
  std::snprintf(numbers[0], sizeof numbers[0], "%g", low);
  std::snprintf(numbers[1], sizeof numbers[1], "%g", high);
  std::snprintf(numbers[2], sizeof numbers[2], "%g", value);
  throw ValueError("[" + std::string(op) + "] " + std::string(arg) + ": must be in " + numbers[0] + " to " +
                   numbers[1] + " (" + std::string(why) + "), got " + numbers[2]);
}

}  // namespace fieldmark::distort
