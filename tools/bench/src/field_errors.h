#pragma once
#include <fieldmark/core/worst.h>

#include <cmath>
#include <limits>

namespace fieldmark::bench {

/// Differences of images from a reference, summed over views. A NaN in either makes every figure of its kind
/// NaN.
struct FieldErrors {
  double squares = 0;       ///< of the differences
  double worst = 0;         ///< magnitude of a difference
  double dropped = 0;       ///< opacity that the reference has and the images lack, over all pixels
  double dropped_most = 0;  ///< of one pixel
  double colours = 0;       ///< differences added
  double pixels = 0;        ///< opacities added

  /// Adds the difference of one colour of a pixel.
  void add(double difference) {
    squares += difference * difference;
    raise_to(worst, std::abs(difference));
    ++colours;
  }
  /// Adds the opacity that a pixel lacks; one of more than the reference's counts as 0.
  void drop(double opacity) {
    dropped += opacity < 0 ? 0 : opacity;
    raise_to(dropped_most, opacity);
    ++pixels;
  }
  /// In dB; infinite without a difference.
  double psnr() const {
    return squares == 0 ? std::numeric_limits<double>::infinity() : -10 * std::log10(squares / colours);
  }
};

}  // namespace fieldmark::bench
