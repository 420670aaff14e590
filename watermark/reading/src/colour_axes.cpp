#include "colour_axes.h"
#include <fieldmark/engine/parallel.h>

#include <Eigen/Eigenvalues>

#include "ordered_sum.h"

namespace fieldmark::watermark {
namespace {

constexpr double kLeastPower = 1e-6;  // of rounding to 8 bits

}  // namespace

ColourAxes uncorrelated_axes(const Tensor<float>& rest, const Tensor<float>& power,
                             const std::vector<double>& on_object) {
  using Matrix = Eigen::Matrix3d;
  const auto add = [&](Index begin, Index end, Matrix& sum) {
    for (Index p = begin; p < end; ++p) {
      if (on_object[at(p)] == 0) continue;
      const Eigen::Vector3d r = Eigen::Map<const Eigen::Vector3f>(&rest[3 * p]).cast<double>();
      const auto around = static_cast<double>(power[3 * p] + power[3 * p + 1] + power[3 * p + 2]);
      sum += r * r.transpose() / (around + kLeastPower);
    }
  };
  const Matrix sum = ordered_sum(std::ssize(on_object), Matrix(Matrix::Zero()), add);
  ColourAxes axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  if (!(sum.trace() > 0)) return axes;
  const Matrix vectors = Eigen::SelfAdjointEigenSolver<Matrix>(sum).eigenvectors();
  for (Index a = 0; a < 3; ++a)
    for (Index c = 0; c < 3; ++c) axes[at(a)][at(c)] = static_cast<float>(vectors(c, a));
  return axes;
}

void turn(std::span<float> colours, const ColourAxes& axes) {
  parallel_for(std::ssize(colours) / 3, kPixelChunk, [&](Index begin, Index end) {
    for (Index p = begin; p < end; ++p) {
      float* x = &colours[at(3 * p)];
      const float from[] = {x[0], x[1], x[2]};
      for (std::size_t a = 0; a < 3; ++a)
        x[a] = axes[a][0] * from[0] + axes[a][1] * from[1] + axes[a][2] * from[2];
    }
  });
}

}  // namespace fieldmark::watermark
