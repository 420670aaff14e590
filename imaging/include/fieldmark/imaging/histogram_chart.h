#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// What histogram_chart() draws.
struct Histogram {
  std::string title;                 ///< above
  std::string x;                     ///< below the axis
  std::vector<std::int64_t> counts;  ///< of bins of equal width, from left to right
  double from = 0;                   ///< left edge of the first bin
  double bin = 1;                    ///< width of a bin, > 0
  double mark = 0;                   ///< a place on the axis, drawn as a line, also beyond the bins
  std::string mark_label;            ///< beside that line
};

/// An image of how often each value came, as a standalone SVG file: heights are logarithmic, so that a
/// single one is seen beside a million. All texts may hold anything.
/// @throws ValueError if there is no bin, its width is not positive, a count is negative, or mark is not
/// finite
std::string histogram_chart(const Histogram& histogram);

}  // namespace fieldmark::bench
