#pragma once
#include <functional>

// The scale of a learnt change at which it has a mark PSNR. Private.
namespace fieldmark::watermark {

struct ScaledMark {
  double scale = 1;
  double psnr = 0;  // at this scale, dB
};

// True within 0.02 dB of the target.
bool is_near(const ScaledMark& mark, double target);

// Seeks the scale in [1 / bound, bound] at which measure(scale), in dB, is near the target: the secant method
// over log scale, in a bracket that shrinks with every measurement, which it halves where the secant leaves
// it. The first slope is that of a linear change, 6 dB for a factor of 2, from which networks, rounding and
// clamped colours deviate. Returns the scale whose PSNR is nearest to the target, of 8 measured and `from`.
// Networks are not linear: on a line between two fields the PSNR may fall before it rises.
ScaledMark seek_scale(ScaledMark from, double target, double bound,
                      const std::function<double(double scale)>& measure);

}  // namespace fieldmark::watermark
