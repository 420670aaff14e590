#pragma once
#include <string>
#include <vector>

namespace fieldmark::bench {

/// One bar of bar_chart().
struct Bar {
  std::string label;  ///< left of the bar
  double value = 0;   ///< >= 0; what is not finite is drawn as 0
  std::string note;   ///< right of it
};

/// An image of horizontal bars as a standalone SVG file, as wide as `full` at their longest; a longer one is
/// cut there. Labels and notes may hold any text.
/// @param full  value of the axis' end, > 0   @throws ValueError if it is not positive
std::string bar_chart(const std::string& title, const std::vector<Bar>& bars, double full);

}  // namespace fieldmark::bench
