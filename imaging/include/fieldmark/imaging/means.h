#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

namespace fieldmark {

/// Returns the mean of the finite values, or NaN if there are none. The PSNR of identical images is infinite;
/// that of a view without foreground is NaN.
inline double finite_mean(const std::vector<double>& values) {
  double sum = 0, count = 0;
  for (double v : values)
    if (std::isfinite(v)) {
      sum += v;
      count += 1;
    }
  return count > 0 ? sum / count : std::nan("");
}

/// Returns the 5th percentile without interpolation.   @param values  at least one
inline double percentile_5(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(0.05 * static_cast<double>(values.size()))];
}

}  // namespace fieldmark
