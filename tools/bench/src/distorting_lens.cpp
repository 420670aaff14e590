#include "distorting_lens.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace fieldmark::bench {

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
  return nerf::render_scene(options, camera, [&](double px, double py) -> std::array<double, 2> {
    const double x = (px - camera.cx) / camera.fx, y = (py - camera.cy) / camera.fy, d = std::hypot(x, y);
    const double grows = d > 0 ? lens.undistorted(d) / d : 1;
    return {grows * x, grows * y};
  });
}

}  // namespace fieldmark::bench
