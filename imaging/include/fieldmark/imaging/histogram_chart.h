#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// Input of histogram_chart().
struct Histogram {
  std::string title;                 ///< above the chart
  std::string x;                     ///< below the axis
  std::vector<std::int64_t> counts;  ///< bins of equal width, from left to right
  double from = 0;                   ///< left edge of the first bin
  double bin = 1;                    ///< width of a bin, > 0
  double mark = 0;                   ///< position on the axis of a marker line, possibly outside the bins
  std::string mark_label;            ///< text next to that line
};

/// Draws a histogram as a standalone SVG file. Heights are logarithmic, so that a count of one is visible
/// next to a million. Texts may contain any characters.
/// @throws ValueError if there is no bin, its width is not positive, a count is negative, or mark is not
/// finite
std::string histogram_chart(const Histogram& histogram);

}  // namespace fieldmark::bench
