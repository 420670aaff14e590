#include "cli/camera_path.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/tools/results/report.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

namespace fieldmark::cli {
namespace {

using Eigen::Vector3d;
using nlohmann::json;
using std::numbers::pi;

Vector3d vector_of(const nerf::Vec3& v) { return {v[0], v[1], v[2]}; }

// A camera with the span's intrinsics.
nerf::Camera camera_of(const nerf::CameraSpan& span, Index size) {
  const double w = static_cast<double>(span.width);
  nerf::Camera camera{.fx = span.fx * w,
                      .fy = span.fy * w,
                      .cx = span.cx * w,
                      .cy = span.cy * w,
                      .width = span.width,
                      .height = span.height};
  return camera.scaled(size);
}

nerf::Camera camera_at(const Vector3d& eye, const nerf::CameraSpan& span, Index size) {
  nerf::Camera camera = camera_of(span, size);
  camera.pose = nerf::look_at({eye[0], eye[1], eye[2]}, span.centre, span.up);
  return camera;
}

// The azimuths that training cameras cover: all of them, or an arc.
struct Arc {
  double middle = 0, half = pi;
};

Arc covered(std::vector<double> azimuths) {
  if (azimuths.empty()) return {};  // all cameras look straight down or up
  std::ranges::sort(azimuths);
  double gap = azimuths.front() + 2 * pi - azimuths.back(), after = azimuths.back();
  for (std::size_t i = 1; i < azimuths.size(); ++i)
    if (azimuths[i] - azimuths[i - 1] > gap) gap = azimuths[i] - azimuths[i - 1], after = azimuths[i - 1];
  if (gap <= pi / 2) return {};
  return {.middle = after + gap / 2 + pi, .half = pi - gap / 2};
}

// Where a camera stands, for two numbers in [0, 1]: how far it is to the right and how high.
class Places {
 public:
  virtual ~Places() = default;
  virtual Vector3d at(double right, double high) const = 0;
  virtual bool closed() const { return false; }  // right 0 is beside right 1
  virtual double usual_height() const { return 0.5; }
};

// In front of a forward-facing capture: the middle half of the training cameras' positions.
class Plane : public Places {
 public:
  explicit Plane(const nerf::CameraSpan& span) : middle_(0, 0, 0) {
    std::vector<Vector3d> eyes;
    for (std::size_t i = 0; i < span.directions.size(); ++i) {
      eyes.emplace_back(vector_of(span.centre) + span.distances[i] * vector_of(span.directions[i]));
      middle_ += eyes.back() / static_cast<double>(span.directions.size());
    }
    const Vector3d backward = (middle_ - vector_of(span.centre)).normalized();
    right_ = vector_of(span.up).cross(backward).normalized();
    up_ = backward.cross(right_);
    double across = 0, along = 0;
    for (const Vector3d& eye : eyes) {
      across = std::max(across, std::abs((eye - middle_).dot(right_)));
      along = std::max(along, std::abs((eye - middle_).dot(up_)));
    }
    right_ *= across / 2, up_ *= along / 2;
  }
  Vector3d at(double right, double high) const override {
    return middle_ + (2 * right - 1) * right_ + (2 * high - 1) * up_;
  }

 private:
  Vector3d middle_, right_, up_;
};

// Around an object: the training cameras' median distance and range of heights, and their azimuths.
class Sphere : public Places {
 public:
  explicit Sphere(const nerf::CameraSpan& span) : centre_(vector_of(span.centre)), up_(vector_of(span.up)) {
    x_ = up_.unitOrthogonal();
    y_ = up_.cross(x_);
    std::vector<double> azimuths, distances = span.distances;
    for (const nerf::Vec3& d : span.directions) {
      const Vector3d v = vector_of(d);
      double elevation = std::asin(std::clamp(v.dot(up_), -1.0, 1.0));
      if (std::abs(elevation) < kSteepest) azimuths.push_back(std::atan2(v.dot(y_), v.dot(x_)));
      elevation = std::clamp(elevation, -kSteepest, kSteepest);
      low_ = std::min(low_, elevation), high_ = std::max(high_, elevation);
      mean_ += elevation / static_cast<double>(span.directions.size());
    }
    arc_ = covered(azimuths);
    std::ranges::nth_element(distances, distances.begin() + std::ssize(distances) / 2);
    distance_ = distances[distances.size() / 2];
  }
  Vector3d at(double right, double high) const override {
    const double azimuth = closed() ? 2 * pi * right : arc_.middle + 0.9 * arc_.half * (2 * right - 1),
                 elevation = low_ + high * (high_ - low_);
    const Vector3d flat = std::cos(azimuth) * x_ + std::sin(azimuth) * y_;
    return centre_ + distance_ * (std::cos(elevation) * flat + std::sin(elevation) * up_);
  }
  bool closed() const override { return arc_.half == pi; }
  double usual_height() const override { return high_ > low_ ? (mean_ - low_) / (high_ - low_) : 0; }

 private:
  static constexpr double kSteepest = 75 * pi / 180;
  Vector3d centre_, up_, x_, y_;
  Arc arc_;
  double low_ = kSteepest, high_ = -kSteepest, mean_ = 0, distance_ = 1;
};

std::unique_ptr<const Places> places_of(const nerf::CameraSpan& span) {
  if (span.forward_facing) return std::make_unique<Plane>(span);
  return std::make_unique<Sphere>(span);
}

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& place,
                         const std::string& expected, const json& found) {
  const std::string text =
      found.is_null()         ? "nothing"
      : found.is_structured() ? "an " + std::string(found.type_name()) + " of " + std::to_string(found.size())
                              : found.dump(-1, ' ', false, json::error_handler_t::replace).substr(0, 60);
  throw IoError(path.string() + ": " + place + ": expected " + expected + ", found " + text);
}

// Returns a number of an object; nothing if it is not there. @throws IoError unless it is in [low, high]
std::optional<double> number_of(const json& object, const char* key, double low, double high,
                                const std::filesystem::path& path, const std::string& place) {
  const json value = object.value(key, json());
  if (value.is_null()) return {};
  if (!value.is_number() || !(value.get<double>() >= low && value.get<double>() <= high))
    refuse(path, place + key, "a number from " + results::shown(low) + " to " + results::shown(high), value);
  return value.get<double>();
}

// Returns a camera with the intrinsics that an object states, and others where it states none.
nerf::Camera intrinsics_of(const json& object, nerf::Camera camera, const std::filesystem::path& path,
                           const std::string& place) {
  const auto number = [&](const char* key, double low, double high) {
    return number_of(object, key, low, high, path, place);
  };
  const auto w = number("w", 1, 8192), h = number("h", 1, 8192);
  if (w || h)
    camera =
        camera.scaled(w ? static_cast<Index>(*w) : camera.width, h ? static_cast<Index>(*h) : camera.height);
  if (const auto angle = number("camera_angle_x", 0.001, 3.14))
    camera = nerf::make_camera(camera.pose, *angle, camera.width, camera.height);
  if (const auto fx = number("fl_x", 1e-3, 1e6)) camera.fx = camera.fy = *fx;
  if (const auto fy = number("fl_y", 1e-3, 1e6)) camera.fy = *fy;
  if (const auto cx = number("cx", -1e6, 1e6)) camera.cx = *cx;
  if (const auto cy = number("cy", -1e6, 1e6)) camera.cy = *cy;
  return camera;
}

nerf::Pose pose_of(const json& frame, const std::filesystem::path& path, const std::string& place) {
  const json matrix = frame.is_object() ? frame.value("transform_matrix", json()) : json();
  if (!matrix.is_array() || matrix.size() < 3 || matrix.size() > 4)
    refuse(path, place + "transform_matrix", "3 or 4 rows", matrix);
  std::array<double, 16> m{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  for (std::size_t i = 0; i < matrix.size(); ++i) {
    const std::string row = place + "transform_matrix[" + std::to_string(i) + "]";
    if (!matrix[i].is_array() || matrix[i].size() != 4) refuse(path, row, "4 numbers", matrix[i]);
    for (std::size_t j = 0; j < 4; ++j) {
      const json& value = matrix[i][j];
      if (!value.is_number() || !(std::abs(value.get<double>()) < 1e9))
        refuse(path, row + "[" + std::to_string(j) + "]", "a number below 1e9", value);
      m[4 * i + j] = value.get<double>();
    }
  }
  if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
    refuse(path, place + "transform_matrix[3]", "0, 0, 0, 1", matrix[3]);
  Eigen::Matrix3d r;
  r << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  if (!((r.transpose() * r).isIdentity(1e-3) && r.determinant() > 0))
    refuse(path, place + "transform_matrix", "a rotation in its first three columns, to 0.001", matrix);
  nerf::Pose pose{};
  std::copy_n(m.begin(), 12, pose.begin());
  return pose;
}

}  // namespace

std::vector<nerf::Camera> orbit(const nerf::CameraSpan& span, Index count, Index size) {
  const auto places = places_of(span);
  std::vector<nerf::Camera> cameras;
  for (Index i = 0; i < count; ++i) {
    const double phase = static_cast<double>(i) / static_cast<double>(count), swing = 2 * pi * phase,
                 right = places->closed() ? phase : 0.5 + 0.5 * std::sin(swing),
                 high = span.forward_facing ? 0.5 + 0.5 * std::cos(swing) : places->usual_height();
    cameras.push_back(camera_at(places->at(right, high), span, size));
  }
  return cameras;
}

CameraGrid camera_grid(const nerf::CameraSpan& span, Index rows, Index columns, Index size) {
  const auto places = places_of(span);
  CameraGrid grid{.rows = rows, .columns = columns, .closed = places->closed(), .cameras = {}};
  const auto part = [](Index i, Index n, bool ring) {
    return n == 1 ? 0.5 : static_cast<double>(i) / static_cast<double>(ring ? n : n - 1);
  };
  for (Index row = 0; row < rows; ++row)
    for (Index column = 0; column < columns; ++column)
      grid.cameras.push_back(
          camera_at(places->at(part(column, columns, grid.closed), 1 - part(row, rows, false)), span, size));
  return grid;
}

std::vector<nerf::Camera> read_camera_path(const std::filesystem::path& path, const nerf::CameraSpan& span,
                                           Index size) {
  json file;
  try {
    file = json::parse(read_text(path));
  } catch (const json::exception& e) {
    throw IoError(path.string() + ": expected JSON with \"frames\", found " + e.what());
  }
  const json frames = file.is_object() ? file.value("frames", json()) : json();
  if (!frames.is_array() || frames.empty())
    refuse(path, "frames", "a list of cameras, each with \"transform_matrix\"", frames);
  const nerf::Camera all = intrinsics_of(file, camera_of(span, 0), path, "");
  std::vector<nerf::Camera> cameras;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string place = "frames[" + std::to_string(i) + "].";
    const nerf::Pose pose = pose_of(frames[i], path, place);
    cameras.push_back(intrinsics_of(frames[i], all, path, place).scaled(size));
    cameras.back().pose = pose;
  }
  return cameras;
}

}  // namespace fieldmark::cli
