#include "transforms.h"

#include <cmath>
#include <numbers>

#include "json_place.h"
#include "rotation.h"

namespace fieldmark::nerf {
namespace {
using Json = nlohmann::json;

std::string four_digits(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", x);
  return text;
}

void refuse_other_lenses(const JsonPlace& from) {
  for (const char* key : {"k3", "k4"})
    if (from.has(key) && from[key].number() != 0)
      from[key].fail("0 (of radial distortion, k1 and k2 only are known here)",
                     four_digits(from[key].number()));
  if (from.has("is_fisheye") && !from["is_fisheye"].is_false())
    from["is_fisheye"].fail("false (fisheye lenses are not known here)", "something else");
  if (!from.has("camera_model")) return;
  const std::string model = from["camera_model"].text();
  for (const char* known : {"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"})
    if (model == known) return;
  from["camera_model"].fail("OPENCV, PINHOLE, SIMPLE_PINHOLE, SIMPLE_RADIAL or RADIAL", "\"" + model + "\"");
}

// The intrinsics at one place replace those of `to`.
void parse_intrinsics(const JsonPlace& from, Intrinsics& to) {
  refuse_other_lenses(from);
  const auto read = [&](const char* key, auto& value, double low, double high, const char* range) {
    if (!from.has(key)) return false;
    value = from[key].number_in(low, high, range);
    return true;
  };
  const char *angles = "(0, pi) radians", *pixels = "(0.001, 1e9) pixels", *any = "(-1e9, 1e9)";
  // Angle and length state the same thing: the one at this place overrides either from above.
  if (read("camera_angle_x", to.angle_x, 0, std::numbers::pi, angles)) to.fl_x = 0;
  if (read("camera_angle_y", to.angle_y, 0, std::numbers::pi, angles)) to.fl_y = 0;
  read("fl_x", to.fl_x, 1e-3, 1e9, pixels), read("fl_y", to.fl_y, 1e-3, 1e9, pixels);
  read("cx", to.cx, -1e9, 1e9, any), read("cy", to.cy, -1e9, 1e9, any);
  if (from.has("w")) to.width = from["w"].side();
  if (from.has("h")) to.height = from["h"].side();
  read("k1", to.lens.k1, -1e9, 1e9, any), read("k2", to.lens.k2, -1e9, 1e9, any);
  read("p1", to.lens.p1, -1e9, 1e9, any), read("p2", to.lens.p2, -1e9, 1e9, any);
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
  pose = checked_rotation(
      pose, [&](const std::string& found) { matrix.fail("a rotation in the upper left 3x3", found); });
  for (std::size_t c = 0; c < 4; ++c)
    if (std::abs(m[12 + c] - (c == 3 ? 1 : 0)) > 1e-6)
      matrix.at(3).fail("the row 0 0 0 1", four_digits(m[12 + c]) + " in column " + std::to_string(c));
  return pose;
}

Transforms::Frame parse_frame(const JsonPlace& frame, const JsonPlace& root, const Intrinsics& all) {
  const JsonPlace file = frame["file_path"];
  Transforms::Frame made{.file_path = file.text(), .intrinsics = all};
  if (made.file_path.empty()) file.fail("the name of an image", "an empty text");
  if (made.file_path.find('\0') != std::string::npos) file.fail("the name of an image", "a text with a NUL");
  parse_intrinsics(frame, made.intrinsics);
  if (made.intrinsics.fl_x == 0 && made.intrinsics.angle_x == 0)
    root.fail("the key \"camera_angle_x\" or \"fl_x\"", "neither, nor in " + frame.place());
  if ((made.intrinsics.width == 0) != (made.intrinsics.height == 0))
    root.fail("the keys \"w\" and \"h\" or neither of them", "one");
  made.pose = parse_pose(frame["transform_matrix"]);
  return made;
}
}  // namespace

Transforms parse_transforms(std::string_view text, std::string_view path) {
  const Json json = parse_json(text, path);
  const JsonPlace root(json, std::string(path));
  Transforms t;
  Intrinsics all;
  if (json.is_object()) parse_intrinsics(root, all);
  t.camera_angle_x = all.angle_x;
  const JsonPlace frames = root["frames"];
  const std::size_t count = frames.array_size();
  if (count == 0) frames.fail("at least one view", "none");
  t.frames.resize(count);
  for (std::size_t i = 0; i < count; ++i) t.frames[i] = parse_frame(frames.at(i), root, all);
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
