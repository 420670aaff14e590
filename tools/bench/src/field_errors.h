#pragma once
#include <fieldmark/core/worst.h>

#include <cmath>
#include <limits>

namespace fieldmark::bench {

/// Accumulates differences between images and a reference over views. A NaN in either makes every figure of
/// its kind NaN.
struct FieldErrors {
  double squares = 0;       ///< sum of squared differences
  double worst = 0;         ///< largest absolute difference
  double dropped = 0;       ///< missing opacity relative to the reference, over all pixels
  double dropped_most = 0;  ///< largest of one pixel
  double colours = 0;       ///< number of differences added
  double pixels = 0;        ///< number of opacities added

  /// Adds the difference of one colour of a pixel.
  void add(double difference) {
    squares += difference * difference;
    raise_to(worst, std::abs(difference));
    ++colours;
  }
  /// Adds the missing opacity of a pixel; an excess over the reference counts as 0.
  void drop(double opacity) {
    dropped += opacity < 0 ? 0 : opacity;
    raise_to(dropped_most, opacity);
    ++pixels;
  }
  /// Returns the PSNR in dB; infinity if all differences are 0.
  double psnr() const {
    return squares == 0 ? std::numeric_limits<double>::infinity() : -10 * std::log10(squares / colours);
  }
};

}  // namespace fieldmark::bench
