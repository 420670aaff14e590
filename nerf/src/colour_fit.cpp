#include <fieldmark/core/error.h>
#include <fieldmark/nerf/colour_fit.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>

#include "silhouettes.h"

namespace fieldmark::nerf {
namespace {

constexpr double kHold = 1e-4;  // weight of the identity, relative to the pixels

// The normal equations of D, with row D_k for channel k: (sum c c^T) D_k = sum c (t_k - c_k).
class AffineFit {
 public:
  void add(const Eigen::Vector4d& c, const Eigen::Vector3d& change) {
    normal_ += c * c.transpose();
    right_ += c * change.transpose();
    ++pixels_;
  }
  Eigen::Matrix<double, 4, 3> solve() const {
    Eigen::Matrix4d held = normal_;
    held.diagonal().array() += kHold * std::max(pixels_, 1.);
    return held.ldlt().solve(right_);
  }

 private:
  Eigen::Matrix4d normal_ = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 3> right_ = Eigen::Matrix<double, 4, 3>::Zero();
  double pixels_ = 0;
};

}  // namespace

Tensor<float> colour_fitted(const Rendering& render, const View& view, Background background) {
  const Tensor<float> truth = composited(view, background);
  if (!(render.rgb.shape == truth.shape))
    throw ShapeError("[colour_fitted] render must be of the view's size " + truth.shape.str() + ", got " +
                     render.rgb.shape.str());
  const Index width = truth.shape[1];
  const auto behind = static_cast<double>(background_value(background));
  const auto number = [](const Tensor<float>& t, Index i) { return static_cast<double>(t[i]); };
  const auto colour = [&](Index i) {
    const double a = number(render.opacity, i), b = (1 - a) * behind;
    return Eigen::Vector4d(number(render.rgb, 3 * i) - b, number(render.rgb, 3 * i + 1) - b,
                           number(render.rgb, 3 * i + 2) - b, a);
  };
  const auto half = [&](Index i) -> std::size_t { return 2 * (i % width) < width ? 0 : 1; };
  std::array<AffineFit, 2> of_half;
  for (Index i = 0; i < render.opacity.size(); ++i) {
    if (!is_valid(view, i)) continue;
    Eigen::Vector3d change;
    for (Index k = 0; k < 3; ++k) change[k] = number(truth, 3 * i + k) - number(render.rgb, 3 * i + k);
    of_half[half(i)].add(colour(i), change);
  }
  const std::array fits{of_half[1].solve(), of_half[0].solve()};
  Tensor<float> out = render.rgb;
  for (Index i = 0; i < render.opacity.size(); ++i) {
    const Eigen::Vector3d change = fits[half(i)].transpose() * colour(i);
    for (Index k = 0; k < 3; ++k)
      out[3 * i + k] = std::clamp(out[3 * i + k] + static_cast<float>(change[k]), 0.f, 1.f);
  }
  return out;
}

}  // namespace fieldmark::nerf
