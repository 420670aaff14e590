#include "tone_fit.h"
#include <fieldmark/engine/shape_checks.h>

#include <Eigen/Cholesky>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr double kHold = 0.01;  // weight of the identity, relative to all pixels
constexpr double kDark = 0.02;  // the slope of v ln v diverges at 0

std::size_t at_(Index i) { return static_cast<std::size_t>(i); }

double bent(double v) { return v > 0 ? v * std::log(v) : 0; }

}  // namespace

double ToneFit::at(Index channel, double v) const {
  const auto c = at_(channel);
  return offset[c] + gain[c] * v + bend[c] * bent(v);
}

double ToneFit::slope(Index channel, double v) const {
  const auto c = at_(channel);
  return gain[c] + bend[c] * (1 + std::log(std::max(v, kDark)));
}

ToneFit fit_tones(const Tensor<float>& render, const Tensor<float>& image, std::span<const double> weight) {
  check_rank("fit_tones", "render", render.shape, 3, "[H, W, 3]");
  check_extent("fit_tones", "render", render.shape, 2, 3, "red, green, blue");
  if (image.shape != render.shape || static_cast<Index>(weight.size()) * 3 != render.size())
    throw ShapeError("[fit_tones] image and weight must fit the render " + render.shape.str() +
                     ", got shape " + image.shape.str() + " and " + std::to_string(weight.size()) +
                     " weights");
  ToneFit fit;
  for (Index c = 0; c < 3; ++c) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double total = 0;
    for (Index p = 0; p < static_cast<Index>(weight.size()); ++p) {
      const double w = weight[at_(p)], v = static_cast<double>(render[3 * p + c]);
      const Eigen::Vector3d row(1, v, bent(v));
      normal += w * row * row.transpose();
      right += w * (static_cast<double>(image[3 * p + c]) - v) * row;
      total += w;
    }
    if (!(total > 0)) continue;
    normal.diagonal().array() += kHold * total;
    const Eigen::Vector3d change = normal.ldlt().solve(right);
    fit.offset[at_(c)] = change[0];
    fit.gain[at_(c)] = 1 + change[1];
    fit.bend[at_(c)] = change[2];
  }
  return fit;
}

}  // namespace fieldmark::watermark
