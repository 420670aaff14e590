#pragma once
#include <fieldmark/imaging/scatter_chart.h>

namespace fieldmark::bench {

/// A line of line_chart().
struct LineSeries {
  /// One place of a line.
  struct Point {
    double x = 0;  ///< points where x or y is not finite are left out
    double y = 0;  ///< on the axis that all lines share
  };
  std::string name;           ///< in the legend
  std::vector<Point> points;  ///< joined from left to right, whatever their order
  bool dashed = false;        ///< for figures of others
};

/// An image of lines as a standalone SVG file, both axes linear; y goes from y_low to y_high, and what lies
/// outside is drawn at the border. All texts may hold anything.
/// @throws ValueError if no point can be drawn, or y_low is not below y_high
std::string line_chart(const ScatterText& text, const std::vector<LineSeries>& lines, double y_low,
                       double y_high);

}  // namespace fieldmark::bench
