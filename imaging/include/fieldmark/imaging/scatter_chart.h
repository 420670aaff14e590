#pragma once
#include <limits>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// One point of scatter_chart().
struct ScatterPoint {
  double x = 0;         ///< > 0, drawn on a logarithmic axis
  double y = 0;         ///< points with a non-finite x or y are skipped
  std::string series;   ///< points of a series share a colour; the legend below the title lists them in order
  std::string label{};  ///< text next to the point; may be empty
  bool line = false;    ///< joined from left to right with all other `line` points
  bool ring = false;    ///< drawn with a ring: the setting in use
};

/// Title and axis labels of a scatter chart.
struct ScatterText {
  std::string title;  ///< above the chart
  std::string x;      ///< below the x axis
  std::string y;      ///< at the upper left
  /// True if every series is a curve through its points in their order, labelled at its last point. `line`
  /// and the legend are then ignored.
  bool curves = false;
  /// Upper limit of the y axis if no point can exceed it, such as 100 for percentages.
  double y_most = std::numeric_limits<double>::infinity();
};

/// Draws points as a standalone SVG file with a logarithmic x axis. Labels move up or down so that they do
/// not overlap. Texts may contain any characters.
/// @throws ValueError if no point can be drawn, or an x is not positive
std::string scatter_chart(const ScatterText& text, const std::vector<ScatterPoint>& points);

}  // namespace fieldmark::bench
