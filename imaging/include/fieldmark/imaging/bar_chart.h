#pragma once
#include <string>
#include <vector>

namespace fieldmark::bench {

/// A bar of bar_chart().
struct Bar {
  std::string label;  ///< left of the bar
  double value = 0;   ///< >= 0; non-finite values are drawn as 0
  std::string note;   ///< right of the bar
};

/// Draws horizontal bars as a standalone SVG file. A bar of value `full` spans the whole width; longer bars
/// are cut there. Labels and notes may contain any text.
/// @param full  value at the end of the axis, > 0   @throws ValueError if it is not positive
std::string bar_chart(const std::string& title, const std::vector<Bar>& bars, double full);

}  // namespace fieldmark::bench
