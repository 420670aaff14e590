#pragma once
#include <span>
#include <vector>

namespace fieldmark::bench {

/// One way of doing something: what it costs and how good it is.
struct SpeedQuality {
  double seconds = 0;  ///< less is better
  double psnr = 0;     ///< more is better, dB
  double bytes = 0;    ///< of a file or of memory: less is better
};

/// What counts as equal: times of the same work differ, and nobody sees a tenth of a decibel.
struct ParetoMargin {
  double time = 0.04;  ///< part of a time, in [0, 1)
  double psnr = 0.1;   ///< dB, >= 0
};

/// Marks the points that no other one beats, for any number of figures of which more is better. One beats
/// another if it is better in one figure by more than the margin, and worse by more than the margin in none.
/// A point with a figure that is no number loses. @param margins  of each figure, in its unit
/// @throws ValueError if a margin is not positive or 0, or a point has another number of figures
std::vector<bool> pareto_front(std::span<const std::vector<double>> points, std::span<const double> margins);

/// Marks the points that no other one beats. One beats another if it is faster or more exact by more than the
/// margin, or smaller, and neither slower nor less exact by more than the margin, nor larger. Times that are
/// not finite and PSNRs that are no number lose. @throws ValueError if a margin is out of range
std::vector<bool> pareto_front(std::span<const SpeedQuality> points, const ParetoMargin& margin = {});

}  // namespace fieldmark::bench
