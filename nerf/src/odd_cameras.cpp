#include "odd_cameras.h"

#include <fieldmark/core/error.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include "odd_images.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNarrowest = 2, kWidest = 150;  // degrees
constexpr std::size_t kLeastCameras = 5;         // fewest cameras of which one can be outlying
constexpr double kFarCamera = 2.5;
constexpr double kNearlyAll = 0.95;
constexpr double kCorner = 1. / 16;  // of the sides: where principal points in shares, not pixels, lie

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

std::string formatted(const char* format, double a, double b = 0) {
  char text[80];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

double field_of_view(const Camera& c) {
  return 2 * std::atan(0.5 * static_cast<double>(c.width) / c.fx) / kDegree;
}

// Adds the views of these indices to `all`, if there are any. @param text  follows their count
void add_views(std::vector<Oddity>& all, std::span<const SurveyedView> views,
               const std::vector<std::size_t>& odd, Oddity found, const std::string& text) {
  if (odd.empty()) return;
  found.count = std::ssize(odd);
  for (const std::size_t i : odd) found.images.push_back(full_name(views[i]));
  found.text = std::to_string(odd.size()) + " of " + std::to_string(views.size()) + text;
  all.push_back(std::move(found));
}

template <class F>
std::vector<std::size_t> numbers_where(std::span<const SurveyedView> views, F is_odd) {
  std::vector<std::size_t> odd;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (is_odd(i)) odd.push_back(i);
  return odd;
}

void add_outlying(std::vector<Oddity>& all, std::span<const SurveyedView> views) {
  const std::vector<bool> far = outlying(views);
  const auto odd = numbers_where(views, [&](std::size_t i) { return far[i]; });
  if (odd.empty()) return;
  const std::vector<double> distances = distances_from_middle(views);
  add_views(all, views, odd,
            {.kind = "outlying_cameras",
             .remedy = "check their poses, or remove them: the extent of the scene follows the cameras"},
            " cameras far from the others, the first is that of " + full_name(views[odd.front()]) +
                formatted(" at %.3g times the median distance from their middle",
                          distances[odd.front()] / median_of(distances)));
}

// Finds cameras without the point nearest to all axes in their image; in a place, where cameras may look
// anywhere, only if nearly all have it behind them.
void add_looking_away(std::vector<Oddity>& all, std::span<const SurveyedView> views, bool is_place) {
  const auto span = span_without(views, outlying(views));
  if (!span) return;
  const auto odd = numbers_where(views, [&](std::size_t i) {
    const Camera& c = views[i].camera;
    const Vec3 to = span->centre - c.position();
    const double half = std::atan(
        0.5 * std::hypot(static_cast<double>(c.width) / c.fx, static_cast<double>(c.height) / c.fy));
    return norm(to) > 0 && dot(normalised(c.forward()), normalised(to)) < (is_place ? 0 : std::cos(half));
  });
  const double share = static_cast<double>(odd.size()) / static_cast<double>(views.size());
  if (odd.empty() || (is_place && share < kNearlyAll)) return;
  Oddity found{.kind = "cameras_look_away", .remedy = "check their poses, or remove them with their images"};
  if (share > 0.5)
    found.remedy =
        std::string(is_place ? "of a room seen from its middle this is right; else check" : "check") +
        " the convention of the poses: matrices go from the camera to the world, and the camera looks "
        "along -z with y up (OpenGL); of OpenCV's axes, negate the second and third column";
  add_views(all, views, odd, std::move(found),
            " cameras look away from the point that their axes have in common, the first is that of " +
                full_name(views[odd.front()]));
}

void add_equal_poses(std::vector<Oddity>& all, std::span<const SurveyedView> views) {
  std::map<Pose, std::size_t> firsts;
  Oddity found{.kind = "equal_poses",
               .remedy = "give each image its own pose, or remove those whose pose is not known"};
  const auto odd = numbers_where(views, [&](std::size_t i) {
    const auto [first, is_new] = firsts.emplace(views[i].camera.pose, i);
    if (is_new || same_image(views[first->second], views[i])) return false;
    found.partners.push_back(full_name(views[first->second]));
    return true;
  });
  if (odd.empty()) return;
  const std::string first = full_name(views[odd.front()]) + ", as that of " + found.partners.front();
  add_views(all, views, odd, std::move(found),
            " cameras with the pose of another though their images differ, the first is that of " + first);
}

void add_intrinsics(std::vector<Oddity>& all, std::span<const SurveyedView> views) {
  auto odd = numbers_where(views, [&](std::size_t i) {
    const Camera& c = views[i].camera;
    const double x = c.cx / static_cast<double>(c.width), y = c.cy / static_cast<double>(c.height);
    return !(x >= 0 && x <= 1 && y >= 0 && y <= 1) || (x < kCorner && y < kCorner);
  });
  if (!odd.empty()) {
    const SurveyedView& v = views[odd.front()];
    add_views(
        all, views, odd,
        {.kind = "principal_points",
         .remedy =
             "state cx and cy in pixels from the upper left corner of the image that w and h state: multiply "
             "shares by these, and subtract from them what was cut off"},
        " principal points outside the image or in its corner, the first is that of " + full_name(v) +
            formatted(" at (%.4g, %.4g)", v.camera.cx, v.camera.cy) + " of " +
            std::to_string(v.camera.width) + " x " + std::to_string(v.camera.height) + " pixels");
  }
  odd = numbers_where(views, [&](std::size_t i) {
    const double degrees = field_of_view(views[i].camera);
    return !(degrees >= kNarrowest && degrees <= kWidest);
  });
  if (odd.empty()) return;
  add_views(
      all, views, odd,
      {.kind = "focal_lengths",
       .remedy =
           "state fl_x and fl_y in pixels of the size that w and h state: millimetres times width over the "
           "width of the sensor"},
      " horizontal fields of view outside 2 to 150 degrees, the first is that of " +
          full_name(views[odd.front()]) + formatted(" with %.3g", field_of_view(views[odd.front()].camera)));
}

}  // namespace

std::vector<double> distances_from_middle(std::span<const SurveyedView> views) {
  std::vector<double> distances;
  if (views.empty()) return distances;
  Vec3 middle{};
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<double> all;
    for (const SurveyedView& v : views) all.push_back(v.camera.position()[a]);
    middle[a] = median_of(std::move(all));
  }
  for (const SurveyedView& v : views) distances.push_back(norm(v.camera.position() - middle));
  return distances;
}

std::vector<bool> outlying(std::span<const SurveyedView> views) {
  std::vector<bool> far(views.size());
  if (views.size() < kLeastCameras) return far;
  const std::vector<double> distances = distances_from_middle(views);
  std::vector<double> sorted = distances;
  std::ranges::sort(sorted);
  const double most = sorted[(sorted.size() - 1) * 9 / 10], median = sorted[sorted.size() / 2];
  const double reach = std::max(kFarCamera * most, 4 * most - 3 * median);
  for (std::size_t i = 0; i < views.size(); ++i) far[i] = distances[i] > reach;
  return far;
}

std::optional<CameraSpan> span_without(std::span<const SurveyedView> views, const std::vector<bool>& far) {
  std::vector<Camera> cameras;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (!far[i]) cameras.push_back(views[i].camera);
  try {
    return camera_span(cameras, Background::black);
  } catch (const ValueError&) {
    return std::nullopt;
  }
}

std::vector<Oddity> odd_cameras(std::span<const SurveyedView> views, SceneType scene) {
  std::vector<Oddity> found;
  if (views.empty()) return found;
  add_outlying(found, views);
  if (scene != SceneType::forward) add_looking_away(found, views, scene == SceneType::place);
  add_equal_poses(found, views);
  add_intrinsics(found, views);
  if (const auto distances = distances_from_middle(views);
      views.size() > 1 && std::ranges::max(distances) <= 1e-12 * norm(views.front().camera.position()))
    found.push_back(
        {.kind = "one_place",
         .count = std::ssize(views),
         .text = std::to_string(views.size()) + " cameras at one place",
         .remedy = "take images from several places: from one, nothing tells how far a surface is"});
  return found;
}

}  // namespace fieldmark::nerf
