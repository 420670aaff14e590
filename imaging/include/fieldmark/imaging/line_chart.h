#pragma once
#include <fieldmark/imaging/scatter_chart.h>

namespace fieldmark::bench {

/// A line of line_chart().
struct LineSeries {
  /// A point of a line.
  struct Point {
    double x = 0;  ///< points with a non-finite x or y are skipped
    double y = 0;  ///< on the axis that all lines share
  };
  std::string name;           ///< shown in the legend
  std::vector<Point> points;  ///< joined from left to right, in any order
  bool dashed = false;        ///< for figures from other authors
};

/// Draws lines as a standalone SVG file with linear axes. The y axis runs from y_low to y_high; values
/// outside are drawn at the border. Texts may contain any characters.
/// @throws ValueError if no point can be drawn, or y_low is not below y_high
std::string line_chart(const ScatterText& text, const std::vector<LineSeries>& lines, double y_low,
                       double y_high);

}  // namespace fieldmark::bench
