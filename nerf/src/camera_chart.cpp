#include <fieldmark/core/error.h>
#include <fieldmark/imaging/canvas.h>
#include <fieldmark/nerf/camera_chart.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "rotation.h"

namespace fieldmark::nerf {
namespace {

// Pixels.
constexpr Index kWidth = 1240, kHeight = 700;
constexpr double kPanel = 580, kPanelTop = 90, kGap = 20, kMargin = 30, kTitle = 66;
constexpr double kPyramid = 0.06;  // depth of a camera's pyramid, in panel sides
constexpr double kRoom = 1.12;     // of the cameras in a panel

constexpr Canvas::Ink kText{0.2f, 0.2f, 0.2f}, kFrame{0.8f, 0.8f, 0.8f}, kMark{0.55f, 0.55f, 0.55f},
    kOutlying{0.85f, 0.1f, 0.1f};
const std::map<std::string, Canvas::Ink> kSplitInks{
    {"train", {0.12f, 0.44f, 0.71f}}, {"val", {0.17f, 0.54f, 0.24f}}, {"test", {0.9f, 0.5f, 0.05f}}};

// A view of the scene, given by the world directions that point right and up in it.
struct Panel {
  std::string title;
  double left;  // pixels
  Vec3 right, up;
};

struct Frame {
  Vec3 middle{};
  double scale = 1;  // pixels per unit length
};

CanvasPoint place(const Panel& panel, const Frame& frame, const Vec3& p) {
  const Vec3 from = p - frame.middle;
  return {panel.left + kPanel / 2 + frame.scale * dot(panel.right, from),
          kPanelTop + kPanel / 2 - frame.scale * dot(panel.up, from)};
}

bool is_inside(const Panel& panel, const CanvasPoint& p) {
  return p.x >= panel.left && p.x <= panel.left + kPanel && p.y >= kPanelTop && p.y <= kPanelTop + kPanel;
}

// Returns the up direction, the mean viewing direction perpendicular to it, and the direction to its right.
std::array<Vec3, 3> axes_of(const DataReport& report) {
  const Vec3 up = normalised(report.up);
  Vec3 ahead{};
  for (const ReportedCamera& c : report.cameras)
    if (!c.outlying) ahead = ahead + normalised(c.camera.forward());
  const double mean = norm(ahead) / static_cast<double>(report.cameras.size());
  ahead = ahead - dot(ahead, up) * up;
  // Cameras all around have no common direction: take an axis of the world.
  if (mean < 0.3 || norm(ahead) < 0.1 * static_cast<double>(report.cameras.size())) {
    ahead = std::abs(up[1]) < 0.7 ? Vec3{0, 1, 0} : Vec3{0, 0, -1};
    ahead = ahead - dot(ahead, up) * up;
  }
  ahead = normalised(ahead);
  return {up, ahead, cross(ahead, up)};
}

// Returns a frame that holds the cameras that are not outlying, and the point they look at unless it is far
// away.
Frame frame_of(const DataReport& report, const std::array<Vec3, 3>& axes) {
  std::array<double, 3> low{}, high{};
  bool any = false;
  const auto include = [&](const Vec3& p) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double x = dot(axes[a], p);
      low[a] = any ? std::min(low[a], x) : x, high[a] = any ? std::max(high[a], x) : x;
    }
    any = true;
  };
  const auto extent = [&] {
    double most = 0;
    for (std::size_t a = 0; a < 3; ++a) most = std::max(most, high[a] - low[a]);
    return most;
  };
  for (const ReportedCamera& c : report.cameras)
    if (!c.outlying) include(c.camera.position());
  if (report.distances[1] < 2 * extent()) include(report.centre);
  Frame frame;
  for (std::size_t a = 0; a < 3; ++a) frame.middle = frame.middle + (0.5 * (low[a] + high[a])) * axes[a];
  const double side = kRoom * extent() / (1 - 2 * kPyramid);
  if (side > 0) frame.scale = kPanel / side;
  return frame;
}

void draw_camera(Canvas& canvas, const Panel& panel, const Frame& frame, const ReportedCamera& camera) {
  const Camera& c = camera.camera;
  const Canvas::Ink& ink = camera.outlying ? kOutlying : kSplitInks.at(camera.split);
  const Vec3 p = c.position(), right = pose_column(c.pose, 0), up = pose_column(c.pose, 1);
  const double depth = kPyramid * kPanel / frame.scale;
  const double half_x = std::min(0.5 * static_cast<double>(c.width) / c.fx, 1.) * depth,
               half_y = std::min(0.5 * static_cast<double>(c.height) / c.fy, 1.) * depth;
  const Vec3 image = p + depth * normalised(c.forward());
  std::array<CanvasPoint, 4> corners{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = i == 1 || i == 2 ? half_x : -half_x, y = i < 2 ? half_y : -half_y;
    corners[i] = place(panel, frame, image + x * right + y * up);
  }
  const CanvasPoint apex = place(panel, frame, p);
  for (std::size_t i = 0; i < 4; ++i) {
    canvas.line(apex, corners[i], 1, ink);
    canvas.line(corners[i], corners[(i + 1) % 4], i == 0 ? 2 : 1, ink);  // the upper edge is thick
  }
  canvas.line(apex, apex, 5, ink);
}

// Draws a disc on the panel's edge, with name and distance.
void draw_beyond(Canvas& canvas, const Panel& panel, CanvasPoint at, const ReportedCamera& camera,
                 double times) {
  at.x = std::clamp(at.x, panel.left + 8, panel.left + kPanel - 8);
  at.y = std::clamp(at.y, kPanelTop + 8, kPanelTop + kPanel - 8);
  canvas.line(at, at, 10, kOutlying);
  char text[32];
  std::snprintf(text, sizeof text, ", %.3g away", times);
  const std::string label = camera.name.substr(0, 24) + text;
  const double wide = static_cast<double>(Canvas::text_width(label, 1));
  const bool to_left = at.x + 12 + wide > panel.left + kPanel;
  canvas.text({to_left ? at.x - 12 - wide : at.x + 12, at.y - 4}, label, 1, kOutlying);
}

// Draws a length of 1, 2 or 5 times a power of ten with its number, at the lower left.
void draw_scale(Canvas& canvas, const Panel& panel, const Frame& frame) {
  const double most = 0.3 * kPanel / frame.scale, power = std::pow(10, std::floor(std::log10(most)));
  const double length = power * (most >= 5 * power ? 5 : most >= 2 * power ? 2 : 1);
  const double y = kPanelTop + kPanel - 14, x = panel.left + 14, end = x + length * frame.scale;
  canvas.line({x, y}, {end, y}, 2, kText);
  for (const double at : {x, end}) canvas.line({at, y - 4}, {at, y + 4}, 2, kText);
  char text[32];
  std::snprintf(text, sizeof text, "%g", length);
  canvas.text({x + 4, y - 20}, text, 2, kText);
}

// Draws the world axes as seen in the panel, at the lower right.
void draw_axes(Canvas& canvas, const Panel& panel) {
  const CanvasPoint origin{panel.left + kPanel - 50, kPanelTop + kPanel - 46};
  for (std::size_t a = 0; a < 3; ++a) {
    Vec3 axis{};
    axis[a] = 1;
    const double x = dot(panel.right, axis), y = -dot(panel.up, axis);
    if (std::hypot(x, y) < 0.3) continue;
    canvas.line(origin, {origin.x + 26 * x, origin.y + 26 * y}, 1.5, kMark);
    canvas.text({origin.x + 36 * x - 4, origin.y + 36 * y - 8}, std::string(1, static_cast<char>('x' + a)), 2,
                kMark);
  }
}

void draw_panel(Canvas& canvas, const Panel& panel, const Frame& frame, const DataReport& report) {
  const double l = panel.left, r = l + kPanel, t = kPanelTop, b = kPanelTop + kPanel;
  for (const auto& [from, to] : {std::pair{CanvasPoint{l, t}, CanvasPoint{r, t}},
                                 {{r, t}, {r, b}},
                                 {{r, b}, {l, b}},
                                 {{l, b}, {l, t}}})
    canvas.line(from, to, 1, kFrame);
  canvas.text({l, kTitle}, panel.title, 2, kText);
  const CanvasPoint centre = place(panel, frame, report.centre);
  if (is_inside(panel, centre))
    for (const double s : {-7., 7.}) {
      canvas.line(centre, {centre.x + s, centre.y}, 2, kMark);
      canvas.line(centre, {centre.x, centre.y + s}, 2, kMark);
    }
  for (const ReportedCamera& c : report.cameras) {
    const CanvasPoint at = place(panel, frame, c.camera.position());
    if (is_inside(panel, at))
      draw_camera(canvas, panel, frame, c);
    else
      draw_beyond(canvas, panel, at, c, norm(c.camera.position() - report.centre));
  }
  draw_scale(canvas, panel, frame);
  draw_axes(canvas, panel);
}

void draw_legend(Canvas& canvas, const DataReport& report) {
  canvas.text({kMargin, 20}, "Cameras of " + report.name.substr(0, 60), 3, kText);
  double x = kMargin + kPanel + kGap;
  const auto entry = [&](const std::string& name, Index count, const Canvas::Ink& ink) {
    if (count == 0) return;
    const std::string text = std::to_string(count) + " " + name;
    canvas.line({x + 6, 31}, {x + 6, 31}, 12, ink);
    canvas.text({x + 18, 24}, text, 2, kText);
    x += 50 + static_cast<double>(Canvas::text_width(text, 2));
  };
  const auto count = [&](auto is) { return std::ranges::count_if(report.cameras, is); };
  for (const char* split : {"train", "val", "test"})
    entry(split, count([&](const ReportedCamera& c) { return c.split == split && !c.outlying; }),
          kSplitInks.at(split));
  entry("outlying", count([](const ReportedCamera& c) { return c.outlying; }), kOutlying);
}

}  // namespace

Tensor<float> camera_chart(const DataReport& report) {
  if (report.cameras.empty()) throw ValueError("[camera_chart] cameras must be at least one, got none");
  const auto axes = axes_of(report);
  const auto& [up, ahead, right] = axes;
  const Frame frame = frame_of(report, axes);
  Canvas canvas(kHeight, kWidth);
  draw_legend(canvas, report);
  draw_panel(canvas, {.title = "from above", .left = kMargin, .right = right, .up = ahead}, frame, report);
  draw_panel(canvas, {.title = "from the right", .left = kMargin + kPanel + kGap, .right = ahead, .up = up},
             frame, report);
  return canvas.image();
}

}  // namespace fieldmark::nerf
