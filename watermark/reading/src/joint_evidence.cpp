#include <fieldmark/watermark/reading/joint_evidence.h>

#include <fieldmark/core/error.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

namespace fieldmark::watermark {

namespace {

double product(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

}  // namespace

std::vector<double> scaled_to(const std::vector<double>& other, std::vector<double> evidence) {
  const double ours = product(evidence, evidence), theirs = product(other, other);
  if (ours > 0 && theirs > 0)
    for (double& s : evidence) s *= std::sqrt(theirs / ours);
  return evidence;
}

std::vector<double> joint_evidence(const std::vector<double>& blind, const std::vector<double>& residual,
                                   double trust) {
  if (blind.size() != residual.size())
    throw ShapeError("[joint_evidence] blind and residual must have as many cells, got " +
                     std::to_string(blind.size()) + " and " + std::to_string(residual.size()));
  if (!(trust >= 0))
    throw ValueError("[joint_evidence] trust must be at least 0, got " + std::to_string(trust));
  std::vector<double> joint = scaled_to(blind, residual);
  const double power = product(blind, blind), r = power > 0 ? product(blind, joint) / power : 0;
  if (!(r > 0)) return joint;
  for (std::size_t c = 0; c < joint.size(); ++c) joint[c] += std::min(1.0, trust * r) * blind[c];
  return scaled_to(blind, std::move(joint));
}

}  // namespace fieldmark::watermark
