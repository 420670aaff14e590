#pragma once
#include <limits>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// One point of scatter_chart().
struct ScatterPoint {
  double x = 0;         ///< > 0, drawn on a logarithmic axis
  double y = 0;         ///< points where x or y is not finite are left out
  std::string series;   ///< points of one series share a colour, named below the title in the order they come
  std::string label{};  ///< beside the point; may be empty
  bool line = false;    ///< joined by a line with the others of this kind, from left to right
  bool ring = false;    ///< with a ring around it: the one that is in use
};

/// What stands beside the axes.
struct ScatterText {
  std::string title;  ///< above
  std::string x;      ///< below
  std::string y;      ///< at the upper left
  /// Every series is a curve through its points in the order they come, named beside its last one; `line` and
  /// the names below the title are then not used.
  bool curves = false;
  /// Where y ends at the latest, if no point can be higher: 100 of a share in percent.
  double y_most = std::numeric_limits<double>::infinity();
};

/// An image of points as a standalone SVG file, x on a logarithmic axis. Labels are moved up or down so that
/// they do not lie on each other. All texts may hold anything.
/// @throws ValueError if no point can be drawn, or an x is not positive
std::string scatter_chart(const ScatterText& text, const std::vector<ScatterPoint>& points);

}  // namespace fieldmark::bench
