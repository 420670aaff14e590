#include "joint_evidence.h"

#include <fieldmark/core/error.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace fieldmark::watermark {

std::vector<double> scaled_to(const std::vector<double>& other, std::vector<double> evidence) {
  double ours = 0, theirs = 0;
  for (const double s : evidence) ours += s * s;
  for (const double s : other) theirs += s * s;
  if (ours > 0 && theirs > 0)
    for (double& s : evidence) s *= std::sqrt(theirs / ours);
  return evidence;
}

std::vector<double> joint_evidence(const std::vector<double>& blind, const std::vector<double>& residual) {
  if (blind.size() != residual.size())
    throw ShapeError("[joint_evidence] blind and residual must have as many cells, got " +
                     std::to_string(blind.size()) + " and " + std::to_string(residual.size()));
  const auto product = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
  };
  const double power = product(blind, blind), ours = product(residual, residual);
  if (!(power > 0 && ours > 0)) return residual;
  const double scale = std::sqrt(power / ours), r = std::max(0.0, scale * product(blind, residual) / power);
  const double back = 1 / std::sqrt(1 + 3 * r * r);  // |a + r b|^2 = 1 + 2 r^2 + r^2
  std::vector<double> joint(residual.size());
  for (std::size_t c = 0; c < joint.size(); ++c) joint[c] = back * (scale * residual[c] + r * blind[c]);
  return joint;
}

}  // namespace fieldmark::watermark
