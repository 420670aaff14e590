#include "distorting_lens.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace fieldmark::bench {
namespace {

constexpr Index kFiner = 2;  // pixels of the pinhole image per pixel

// Bilinear value of a premultiplied RGBA image at pixel coordinates whose integers are corners of pixels.
std::array<double, 4> sampled(const Tensor<float>& rgba, double u, double v) {
  const Index height = rgba.shape[0], width = rgba.shape[1];
  const double x = std::clamp(u - 0.5, 0.0, static_cast<double>(width - 1)),
               y = std::clamp(v - 0.5, 0.0, static_cast<double>(height - 1));
  const auto left = std::min<Index>(static_cast<Index>(x), width - 2),
             top = std::min<Index>(static_cast<Index>(y), height - 2);
  const double fx = x - static_cast<double>(left), fy = y - static_cast<double>(top);
  std::array<double, 4> sum{};
  for (const Index dy : {0, 1})
    for (const Index dx : {0, 1}) {
      const float* p = &rgba.data[at(4 * ((top + dy) * width + left + dx))];
      const double weight = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy), alpha = static_cast<double>(p[3]);
      for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * alpha * static_cast<double>(p[k]);
      sum[3] += weight * alpha;
    }
  return sum;
}

}  // namespace

DistortingLens DistortingLens::equidistant() {
  DistortingLens lens;
  lens.fisheye_ = true;
  return lens;
}

DistortingLens DistortingLens::rational() {
  DistortingLens lens;
  constexpr double k[] = {-0.2, 0.03, 0.004, 0.05, -0.004, 0.001};
  std::copy(std::begin(k), std::end(k), lens.k_);
  return lens;
}

double DistortingLens::distorted(double r) const {
  if (fisheye_) return std::atan(r);
  const double q = r * r;
  return r * (1 + q * (k_[0] + q * (k_[1] + q * k_[2]))) / (1 + q * (k_[3] + q * (k_[4] + q * k_[5])));
}

double DistortingLens::undistorted(double d) const {
  double low = 0, high = 2;  // d(2) > 1 for the fisheye; the other is increasing up to 1
  if (!fisheye_) high = 1;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (distorted(middle) < d ? low : high) = middle;
  }
  return (low + high) / 2;
}

std::string DistortingLens::keys() const {
  nlohmann::ordered_json json{{"camera_model", fisheye_ ? "OPENCV_FISHEYE" : "FULL_OPENCV"}};
  for (int k = 0; k < (fisheye_ ? 4 : 6); ++k) json["k" + std::to_string(k + 1)] = k_[k];
  return json.dump();
}

Tensor<float> distorted_image(const nerf::SceneOptions& options, const nerf::Camera& camera,
                              const DistortingLens& lens) {
  const auto reach = [&](double side, double focal) {
    const double half = side / 2 / focal;
    return half * lens.undistorted(half * std::sqrt(2.0)) / (half * std::sqrt(2.0)) * 1.02;
  };
  nerf::Camera wide = camera;
  wide.fx *= kFiner, wide.fy *= kFiner;
  wide.width =
      2 * static_cast<Index>(std::ceil(reach(static_cast<double>(camera.width), camera.fx) * wide.fx));
  wide.height =
      2 * static_cast<Index>(std::ceil(reach(static_cast<double>(camera.height), camera.fy) * wide.fy));
  wide.cx = static_cast<double>(wide.width) / 2, wide.cy = static_cast<double>(wide.height) / 2;
  const Tensor<float> pinhole = nerf::render_scene(options, wide);
  Tensor<float> image(Shape{camera.height, camera.width, 4});
  for (Index y = 0; y < camera.height; ++y)
    for (Index x = 0; x < camera.width; ++x) {
      const double dx = (static_cast<double>(x) + 0.5 - camera.cx) / camera.fx,
                   dy = (static_cast<double>(y) + 0.5 - camera.cy) / camera.fy, d = std::hypot(dx, dy);
      const double grows = d > 0 ? lens.undistorted(d) / d : 1;
      const auto c = sampled(pinhole, wide.cx + grows * dx * wide.fx, wide.cy + grows * dy * wide.fy);
      for (Index k = 0; k < 3; ++k)
        image[4 * (y * camera.width + x) + k] = static_cast<float>(c[3] > 0 ? c[at(k)] / c[3] : 0);
      image[4 * (y * camera.width + x) + 3] = static_cast<float>(c[3]);
    }
  return image;
}

}  // namespace fieldmark::bench
