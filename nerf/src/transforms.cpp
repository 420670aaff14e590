#include "transforms.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <span>

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

// Returns true if a value means no: null, false or 0.
bool says_no(const JsonPlace& value) { return value.is_null() || value.is_false() || value.is_zero(); }

// Reads the model of a lens from camera_model, or fisheye if is_fisheye is set.
void parse_model(const JsonPlace& from, Lens& lens) {
  if (from.has("camera_model")) {
    std::string model = from["camera_model"].text();
    for (char& c : model)
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    const std::pair<const char*, LensModel> known[] = {{"OPENCV", LensModel::polynomial},
                                                       {"PINHOLE", LensModel::polynomial},
                                                       {"SIMPLE_PINHOLE", LensModel::polynomial},
                                                       {"SIMPLE_RADIAL", LensModel::polynomial},
                                                       {"RADIAL", LensModel::polynomial},
                                                       {"PERSPECTIVE", LensModel::polynomial},
                                                       {"FULL_OPENCV", LensModel::rational},
                                                       {"OPENCV_FISHEYE", LensModel::fisheye},
                                                       {"SIMPLE_RADIAL_FISHEYE", LensModel::fisheye},
                                                       {"RADIAL_FISHEYE", LensModel::fisheye}};
    const auto found = std::ranges::find(known, model, [](const auto& k) { return std::string(k.first); });
    if (found == std::end(known)) {
      std::string names;
      for (const auto& [name, unused] : known) names += (names.empty() ? "" : ", ") + std::string(name);
      from["camera_model"].fail("one of " + names, "\"" + model + "\"; undistort the images first");
    }
    lens.model = found->second;
  }
  if (from.has("is_fisheye") && !says_no(from["is_fisheye"])) lens.model = LensModel::fisheye;
  for (const char* other : {"ftheta_p0", "latlong", "equirectangular"})
    if (from.has(other) && !says_no(from[other]))
      from[other].fail("a lens of k1 to k6, p1 and p2", "another one; undistort the images first");
}

// k5 and k6 belong only to the rational model; a fisheye has k1 to k4.
void complete_model(const JsonPlace& frame, Lens& lens) {
  if ((lens.k5 != 0 || lens.k6 != 0) && lens.model == LensModel::polynomial) lens.model = LensModel::rational;
  if (lens.model == LensModel::fisheye && (lens.p1 != 0 || lens.p2 != 0 || lens.k5 != 0 || lens.k6 != 0))
    frame.fail("a fisheye of k1 to k4", "p1, p2, k5 or k6 as well");
}

// Replaces intrinsics in `to` by those at one place.
void parse_intrinsics(const JsonPlace& from, Intrinsics& to) {
  parse_model(from, to.lens);
  const auto read = [&](const char* key, auto& value, double low, double high, const char* range) {
    if (!from.has(key)) return false;
    value = from[key].number_in(low, high, range);
    return true;
  };
  const char *angles = "(0, pi) radians", *pixels = "(0.001, 1e9) pixels", *any = "(-1e9, 1e9)";
  // Angle and length state the same thing: the one at this place overrides either one from the outer level.
  if (read("camera_angle_x", to.angle_x, 0, std::numbers::pi, angles)) to.fl_x = 0;
  if (read("camera_angle_y", to.angle_y, 0, std::numbers::pi, angles)) to.fl_y = 0;
  read("fl_x", to.fl_x, 1e-3, 1e9, pixels), read("fl_y", to.fl_y, 1e-3, 1e9, pixels);
  read("cx", to.cx, -1e9, 1e9, any), read("cy", to.cy, -1e9, 1e9, any);
  if (from.has("w")) to.width = from["w"].side();
  if (from.has("h")) to.height = from["h"].side();
  const std::pair<const char*, double Lens::*> coefficients[] = {
      {"k1", &Lens::k1}, {"k2", &Lens::k2}, {"k3", &Lens::k3}, {"k4", &Lens::k4},
      {"k5", &Lens::k5}, {"k6", &Lens::k6}, {"p1", &Lens::p1}, {"p2", &Lens::p2}};
  for (const auto& [key, coefficient] : coefficients) read(key, to.lens.*coefficient, -1e9, 1e9, any);
}

// The matrices of a file that became poses only after a repair.
struct Repairs {
  std::size_t scaled = 0, divided = 0;
  double scale = 1;                     // of the first scaled matrix
  std::vector<std::size_t> mirrored{};  // numbers of frames
};

void mirror_world(Pose& pose) {
  for (std::size_t c = 0; c < 4; ++c) pose[c] = -pose[c];
}

// Makes a pose from 3 or 4 rows of 4 numbers: divides by the last number of the fourth row (homogeneous
// coordinates), divides a common length out of the columns, and mirrors the world if the axes are a
// reflection.
Pose repaired(const JsonPlace& matrix, std::span<const double> m, Repairs& repairs, std::size_t frame) {
  const double last = m.size() == 16 ? m[15] : 1;
  for (std::size_t c = 0; c < 3 && m.size() == 16; ++c)
    if (!(std::abs(m[12 + c]) <= 1e-6 * std::abs(last)))
      matrix.at(3).fail("the row 0 0 0 1", four_digits(m[12 + c]) + " in column " + std::to_string(c));
  if (!(std::abs(last) > 1e-9)) matrix.at(3).fail("the row 0 0 0 1", four_digits(last) + " in column 3");
  Pose pose{};
  std::copy_n(m.begin(), 12, pose.begin());
  if (std::abs(last - 1) > 1e-6) {
    for (double& x : pose) {
      x /= last;
      if (!std::isfinite(x)) matrix.at(3).fail("the row 0 0 0 1", four_digits(last) + " in column 3");
    }
    ++repairs.divided;
  }
  if (!(rotation_error(pose) <= kRotationTolerance)) {
    if (const double scale = common_scale(pose); scale > 0 && std::abs(scale - 1) > 1e-3) {
      for (std::size_t k = 0; k < 12; ++k)
        if (k % 4 != 3) pose[k] /= scale;
      if (repairs.scaled++ == 0) repairs.scale = scale;
    }
    if (dot(cross(pose_column(pose, 0), pose_column(pose, 1)), pose_column(pose, 2)) < 0) {
      mirror_world(pose);
      repairs.mirrored.push_back(frame);
    }
  }
  return checked_rotation(
      pose, [&](const std::string& found) { matrix.fail("a rotation in the upper left 3x3", found); });
}

Pose parse_pose(const JsonPlace& matrix, Repairs& repairs, std::size_t frame) {
  const std::size_t rows = matrix.array_size();
  if (rows != 4 && rows != 3) matrix.fail("4x4 or 3x4 numbers", std::to_string(rows) + " rows");
  std::vector<double> m;
  for (std::size_t r = 0; r < rows; ++r) {
    const JsonPlace row = matrix.at(r);
    if (row.array_size() != 4) row.fail("4 numbers", std::to_string(row.array_size()));
    for (std::size_t c = 0; c < 4; ++c) m.push_back(row.at(c).number());
  }
  return repaired(matrix, m, repairs, frame);
}

void tell_of_repairs(const JsonPlace& frames, const Repairs& repairs, Transforms& t) {
  const std::string of = " of " + std::to_string(t.frames.size()) + " poses ";
  if (repairs.divided > 0)
    t.notes.push_back(std::to_string(repairs.divided) + of +
                      "are divided by the last number of their fourth row");
  if (repairs.scaled > 0)
    t.notes.push_back(std::to_string(repairs.scaled) + of + "have a scale, the first " +
                      four_digits(repairs.scale) + ", which is taken out of their rotations");
  if (repairs.mirrored.empty()) return;
  if (repairs.mirrored.size() != t.frames.size())
    frames.at(repairs.mirrored.front())["transform_matrix"].fail(
        "a rotation in the upper left 3x3", "a mirror, determinant -1, as in " +
                                                std::to_string(repairs.mirrored.size()) + " of " +
                                                std::to_string(t.frames.size()) + " frames");
  t.notes.push_back("all poses are those of a mirrored world, which is mirrored back along x");
}

// Returns true for keys without effect here: for human readers, or for other programs' use of a scene.
bool is_idle_key(const std::string& key) {
  static const std::set<std::string> keys{"aabb_scale",
                                          "scale",
                                          "offset",
                                          "sharpness",
                                          "rotation",
                                          "colmap_im_id",
                                          "applied_transform",
                                          "applied_scale",
                                          "ply_file_path",
                                          "orientation_override",
                                          "depth_file_path",
                                          "fovx",
                                          "fovy",
                                          "up",
                                          "render_aabb",
                                          "from_na",
                                          "n_extra_learnable_dims",
                                          "enable_depth_loading",
                                          "integer_depth_scale",
                                          "enable_ray_loading",
                                          "is_fisheye",
                                          "frames",
                                          "near",
                                          "far"};
  return keys.contains(key);
}

bool is_used_key(const std::string& key) {
  static const std::set<std::string> keys{"camera_angle_x",
                                          "camera_angle_y",
                                          "fl_x",
                                          "fl_y",
                                          "cx",
                                          "cy",
                                          "w",
                                          "h",
                                          "k1",
                                          "k2",
                                          "k3",
                                          "k4",
                                          "k5",
                                          "k6",
                                          "p1",
                                          "p2",
                                          "camera_model",
                                          "file_path",
                                          "transform_matrix",
                                          "mask_path",
                                          "train_filenames",
                                          "val_filenames",
                                          "test_filenames"};
  return keys.contains(key);
}

void tell_of_keys(const Json& json, Transforms& t) {
  std::set<std::string> unknown;
  bool moving = false, rolling = false;
  const auto look = [&](const Json& object) {
    for (const auto& [key, value] : object.items()) {
      if (key == "time")
        moving = true;
      else if (key == "rolling_shutter")
        rolling = rolling || value != Json::array({0, 0, 0, 0});
      else if (!is_used_key(key) && !is_idle_key(key))
        unknown.insert(key);
    }
  };
  look(json);
  for (const Json& frame : json["frames"]) look(frame);
  if (moving)
    t.notes.push_back("frames have a time, which is not used: a scene that moves is taken as still");
  if (rolling)
    t.notes.push_back("rolling_shutter is not known and not used: each image is taken as one moment");
  if (unknown.empty()) return;
  std::string names;
  for (const std::string& key : unknown) names += (names.empty() ? "" : ", ") + key.substr(0, 40);
  t.notes.push_back("keys that are not known and not used: " + names);
}

Transforms::Frame parse_frame(const JsonPlace& frame, const JsonPlace& root, const Intrinsics& all,
                              Repairs& repairs, std::size_t number) {
  const JsonPlace file = frame["file_path"];
  Transforms::Frame made{.file_path = file.text(), .intrinsics = all};
  if (made.file_path.empty()) file.fail("the name of an image", "an empty text");
  if (made.file_path.find('\0') != std::string::npos) file.fail("the name of an image", "a text with a NUL");
  parse_intrinsics(frame, made.intrinsics);
  if (made.intrinsics.fl_x == 0 && made.intrinsics.angle_x == 0)
    root.fail("the key \"camera_angle_x\" or \"fl_x\"", "neither, nor in " + frame.place());
  if ((made.intrinsics.width == 0) != (made.intrinsics.height == 0))
    root.fail("the keys \"w\" and \"h\" or neither of them", "one");
  complete_model(frame, made.intrinsics.lens);
  made.pose = parse_pose(frame["transform_matrix"], repairs, number);
  if (frame.has("mask_path") && !frame["mask_path"].is_null()) made.mask_path = frame["mask_path"].text();
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
  Repairs repairs;
  for (std::size_t i = 0; i < count; ++i) t.frames[i] = parse_frame(frames.at(i), root, all, repairs, i);
  tell_of_repairs(frames, repairs, t);
  tell_of_keys(json, t);
  constexpr const char* kLists[] = {"train_filenames", "val_filenames", "test_filenames"};
  for (std::size_t i = 0; i < t.splits.size(); ++i) {
    if (!root.has(kLists[i]) || root[kLists[i]].is_null()) continue;
    const JsonPlace list = root[kLists[i]];
    for (std::size_t k = 0; k < list.array_size(); ++k) t.splits[i].push_back(list.at(k).text());
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
