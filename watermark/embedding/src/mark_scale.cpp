#include "mark_scale.h"

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr double kNear = 0.02;        // dB
constexpr double kLeastSlope = -0.2;  // of PSNR in log scale, relative to a linear change's -20 dB a decade
constexpr int kMeasurements = 8;

}  // namespace

bool is_near(const ScaledMark& mark, double target) { return std::abs(mark.psnr - target) <= kNear; }

ScaledMark seek_scale(ScaledMark from, double target, double bound,
                      const std::function<double(double scale)>& measure) {
  const double least = 1 / bound, most = bound;
  double slope = -1, faint = 0, strong = 2 * most;  // ends of the bracket, at first outside the bounds
  ScaledMark last = from, nearest = from;
  for (int i = 0; i < kMeasurements && std::isfinite(last.psnr) && !is_near(last, target); ++i) {
    (last.psnr > target ? faint : strong) = last.scale;
    double scale = std::clamp(last.scale * std::pow(10.0, (target - last.psnr) / slope / 20), least, most);
    if (!(scale > faint && scale < strong))
      scale = std::sqrt(std::max(faint, least) * std::min(strong, most));
    if (scale == last.scale) break;
    const ScaledMark next{.scale = scale, .psnr = measure(scale)};
    const double secant = (next.psnr - last.psnr) / (20 * std::log10(next.scale / last.scale));
    if (secant < kLeastSlope) slope = secant;
    last = next;
    if (std::abs(last.psnr - target) < std::abs(nearest.psnr - target)) nearest = last;
  }
  return nearest;
}

}  // namespace fieldmark::watermark
