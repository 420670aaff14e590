#pragma once
#include <span>
#include <vector>

namespace fieldmark::bench {

/// Cost and quality of one way of doing something.
struct SpeedQuality {
  double seconds = 0;  ///< lower is better
  double psnr = 0;     ///< higher is better, dB
  double bytes = 0;    ///< of a file or of memory; lower is better
};

/// Differences that count as equal: times of the same work vary, and nobody sees a tenth of a decibel.
struct ParetoMargin {
  double time = 0.04;  ///< relative, in [0, 1)
  double psnr = 0.1;   ///< dB, >= 0
};

/// Marks the points that no other point beats, for any number of figures where more is better. A point beats
/// another if it is better in one figure by more than the margin, and worse by more than the margin in none.
/// Points with a NaN lose. @param margins  one per figure, in its unit
/// @throws ValueError if a margin is negative or NaN, or a point has another number of figures
std::vector<bool> pareto_front(std::span<const std::vector<double>> points, std::span<const double> margins);

/// Marks the points that no other point beats. A point beats another if it is faster or more exact by more
/// than the margin, or smaller, and neither slower nor less exact by more than the margin, nor larger.
/// Non-finite times and NaN PSNRs lose. @throws ValueError if a margin is out of range
std::vector<bool> pareto_front(std::span<const SpeedQuality> points, const ParetoMargin& margin = {});

}  // namespace fieldmark::bench
