#include "llff.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>

#include <cmath>
#include <string>

#include "npy.h"
#include "rotation.h"

namespace fieldmark::nerf {
namespace {
constexpr std::size_t kColumns = 17;
constexpr double kMost = 1e9;  // of any number, and of 1 / near, so that scaling stays far from overflow

std::string shape_text(const std::vector<Index>& shape) {
  std::string text;
  for (const Index n : shape) text += (text.empty() ? "" : " x ") + std::to_string(n);
  return text.empty() ? "one number" : text;
}

LlffView parse_row(const double* r, const std::string& row) {
  const auto fail = [&](const std::string& what, const std::string& expected, const std::string& got) {
    throw IoError(row + ": " + what + ": expected " + expected + ", got " + got);
  };
  for (std::size_t k = 0; k < kColumns; ++k)
    if (!(std::abs(r[k]) < kMost))
      fail("number " + std::to_string(k), "a number in (-1e9, 1e9)", number_text(r[k]));
  Pose p{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double* m = r + 5 * i;
    p[4 * i] = m[1], p[4 * i + 1] = -m[0], p[4 * i + 2] = m[2], p[4 * i + 3] = m[3];
  }
  p = checked_rotation(p, [&](const std::string& found) { fail("numbers 0 to 12", "a rotation", found); });
  const double height = r[4], width = r[9], focal = r[14], near = r[15], far = r[16];
  const auto is_side = [](double side) { return side >= 1 && side <= 65536; };
  if (!is_side(height) || !is_side(width))
    fail("numbers 4 and 9", "height and width of 1 to 65536 pixels",
         std::to_string(height) + " and " + std::to_string(width));
  if (!(focal > 1e-3)) fail("number 14", "a focal length in (0.001, 1e9) pixels", number_text(focal));
  if (!(near > 1 / kMost && far > near))
    fail("numbers 15 and 16", "bounds with 1e-9 < near < far",
         number_text(near) + " and " + number_text(far));
  return {.pose = p,
          .intrinsics = {.fl_x = focal, .width = std::lround(width), .height = std::lround(height)},
          .depth = {.near = near, .far = far}};
}
}  // namespace

std::vector<LlffView> parse_poses_bounds(std::string_view bytes, std::string_view name) {
  const NpyArray array = parse_npy(bytes, name);
  if (array.shape.size() != 2 || array.shape[0] < 1 || array.shape[1] != Index{kColumns})
    throw IoError(std::string(name) + ": expected an array of N x 17, N >= 1, got " +
                  shape_text(array.shape));
  std::vector<LlffView> views;
  for (std::size_t i = 0; i < array.numbers.size() / kColumns; ++i)
    views.push_back(
        parse_row(array.numbers.data() + kColumns * i, std::string(name) + ": row " + std::to_string(i)));
  return views;
}

double recentre_llff(std::vector<LlffView>& views) {
  if (views.empty()) throw ValueError("[recentre_llff] views: must be at least one, got none");
  double nearest = views.front().depth.near;
  Vec3 back{}, up{}, centre{};
  for (const LlffView& v : views) {
    nearest = std::min(nearest, v.depth.near);
    back = back + pose_column(v.pose, 2), up = up + pose_column(v.pose, 1);
    centre = centre + (1 / static_cast<double>(views.size())) * pose_column(v.pose, 3);
  }
  const double scale = 1 / (0.75 * nearest);
  const double enough = 1e-6 * static_cast<double>(views.size());
  const Vec3 z = normalised(back), side = cross(up, z);
  if (!(norm(back) > enough && norm(side) > enough))
    throw ValueError("[recentre_llff] views: must have a mean direction and a mean up across it, got " +
                     number_text(norm(back)) + " and " + number_text(norm(side)) + " as their lengths");
  const Vec3 x = normalised(side), y = cross(z, x);
  for (LlffView& v : views) {
    for (std::size_t c = 0; c < 4; ++c) {
      const Vec3 from = c < 3 ? pose_column(v.pose, c) : scale * (pose_column(v.pose, 3) - centre);
      v.pose[c] = dot(x, from), v.pose[4 + c] = dot(y, from), v.pose[8 + c] = dot(z, from);
    }
    v.depth.near *= scale, v.depth.far *= scale;
  }
  return scale;
}

}  // namespace fieldmark::nerf
