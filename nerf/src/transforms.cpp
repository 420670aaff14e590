#include <fieldmark/nerf/transforms.h>

#include <cmath>
#include <numbers>

#include "json_place.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {
using Json = nlohmann::json;

std::string short_number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", x);
  return text;
}

// Largest entry of |R^T R - I|, and the determinant against 1.
double rotation_error(const Pose& p) {
  const Vec3 x{p[0], p[4], p[8]}, y{p[1], p[5], p[9]}, z{p[2], p[6], p[10]};
  double worst = std::abs(dot(cross(x, y), z) - 1);
  for (const auto& [a, b, want] :
       {std::tuple{x, x, 1.0}, {y, y, 1.0}, {z, z, 1.0}, {x, y, 0.0}, {x, z, 0.0}, {y, z, 0.0}})
    worst = std::max(worst, std::abs(dot(a, b) - want));
  return worst;
}

Pose parse_pose(const JsonPlace& matrix) {
  if (matrix.array_size() != 4) matrix.fail("4x4 numbers", std::to_string(matrix.array_size()) + " rows");
  double m[16];
  for (std::size_t r = 0; r < 4; ++r) {
    const JsonPlace row = matrix.at(r);
    if (row.array_size() != 4) row.fail("4 numbers", std::to_string(row.array_size()));
    for (std::size_t c = 0; c < 4; ++c) m[4 * r + c] = row.at(c).number();
  }
  Pose pose{};
  std::copy_n(m, 12, pose.begin());
  const double error = rotation_error(pose);
  if (!(error <= 1e-3))
    matrix.fail("a rotation in the upper left 3x3",
                "columns that are off orthonormal by " + short_number(error));
  for (std::size_t c = 0; c < 4; ++c)
    if (std::abs(m[12 + c] - (c == 3 ? 1 : 0)) > 1e-6)
      matrix.at(3).fail("the row 0 0 0 1", short_number(m[12 + c]) + " in column " + std::to_string(c));
  return pose;
}
}  // namespace

Transforms parse_transforms(std::string_view text, std::string_view path) {
  const Json json = parse_json(text, path);
  const JsonPlace root(json, std::string(path));
  Transforms t;
  t.camera_angle_x = root["camera_angle_x"].number_in(0, std::numbers::pi, "(0, pi) radians");
  const JsonPlace frames = root["frames"];
  const std::size_t count = frames.array_size();
  if (count == 0) frames.fail("at least one view", "none");
  t.frames.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const JsonPlace file = frames.at(i)["file_path"];
    t.frames[i].file_path = file.text();
    if (t.frames[i].file_path.empty()) file.fail("the name of a picture", "an empty text");
    if (t.frames[i].file_path.find('\0') != std::string::npos)
      file.fail("the name of a picture", "a text with a NUL");
    t.frames[i].pose = parse_pose(frames.at(i)["transform_matrix"]);
  }
  return t;
}

std::string format_transforms(const Transforms& transforms) {
  Json frames = Json::array();
  for (const auto& f : transforms.frames) {
    Json matrix = Json::array();
    for (std::size_t r = 0; r < 3; ++r)
      matrix.push_back({f.pose[4 * r], f.pose[4 * r + 1], f.pose[4 * r + 2], f.pose[4 * r + 3]});
    matrix.push_back({0.0, 0.0, 0.0, 1.0});
    frames.push_back({{"file_path", f.file_path}, {"transform_matrix", matrix}});
  }
  return Json{{"camera_angle_x", transforms.camera_angle_x}, {"frames", frames}}.dump(1) + "\n";
}

}  // namespace fieldmark::nerf
