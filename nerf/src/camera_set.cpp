#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/nerf/camera_set.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "checks.h"
#include "json_place.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {
using Mat3 = std::array<Vec3, 3>;  // symmetric, rows

constexpr int kTries = 256;
constexpr std::pair<const char*, CameraSet> kSets[]{
    {"novel", CameraSet::novel},   {"ring", CameraSet::ring},
    {"sphere", CameraSet::sphere}, {"extrapolated", CameraSet::extrapolated},
    {"closer", CameraSet::closer}, {"farther", CameraSet::farther},
    {"test", CameraSet::test}};

void add_outer(Mat3& m, double scale, const Vec3& v) {
  for (std::size_t i = 0; i < 3; ++i) m[i] = m[i] + (scale * v[i]) * v;
}

// Returns (m + ridge I)^-1 b by Cramer's rule; the ridge matters only where m is singular.
Vec3 solve(Mat3 m, const Vec3& b, double ridge) {
  for (std::size_t i = 0; i < 3; ++i) m[i][i] += ridge;
  const Vec3 a = cross(m[1], m[2]), c = cross(m[2], m[0]), d = cross(m[0], m[1]);
  return (1 / dot(m[0], a)) * (b[0] * a + b[1] * c + b[2] * d);
}

// Returns the mean camera position if the cameras are far from the origin compared with their distance from
// each other, else the origin.
Vec3 local_origin(std::span<const Camera> cameras) {
  constexpr double kSpreads = 1000;  // the ridge of look_at_point() pulls by a billionth of the distance
  Vec3 mean{};
  for (const Camera& c : cameras) mean = mean + (1 / static_cast<double>(cameras.size())) * c.position();
  double spread = 0;
  for (const Camera& c : cameras) spread = std::max(spread, norm(c.position() - mean));
  return spread > 0 && norm(mean) > kSpreads * spread ? mean : Vec3{};
}

// Returns the point with the least sum of squared distances to the viewing axes: sum (I - f f^T) (p - o) = 0.
// Parallel axes leave it undetermined along them; the ridge then picks the point nearest to the local origin.
Vec3 look_at_point(std::span<const Camera> cameras) {
  const Vec3 origin = local_origin(cameras);
  Mat3 m{};
  Vec3 b{};
  for (const Camera& c : cameras) {
    const Vec3 f = normalised(c.forward()), o = c.position() - origin;
    for (std::size_t i = 0; i < 3; ++i) m[i][i] += 1;
    add_outer(m, -1, f);
    b = b + o - dot(f, o) * f;
  }
  const Vec3 point = solve(m, b, 1e-9 * static_cast<double>(cameras.size()));
  return origin == Vec3{} ? point : origin + point;
}

// Returns the direction most nearly perpendicular to the x axes, by one step of inverse iteration on sum x
// x^T from the mean y axis.
Vec3 common_up(std::span<const Camera> cameras) {
  Mat3 m{};
  Vec3 mean{};
  for (const Camera& c : cameras) {
    add_outer(m, 1, normalised({c.pose[0], c.pose[4], c.pose[8]}));
    mean = mean + Vec3{c.pose[1], c.pose[5], c.pose[9]};
  }
  const Vec3 up = solve(m, mean, 1e-9 * static_cast<double>(cameras.size()));
  return norm(up) > 0 ? normalised(up) : Vec3{0, 0, 1};
}

// The sequence of random values for camera i of a set.
class Draw {
 public:
  Draw(std::uint64_t seed, CameraSet kind, Index camera)
      : rng_(seed, 0x63616D00u + static_cast<std::uint64_t>(kind)),
        camera_(static_cast<std::uint64_t>(camera)) {}
  double uniform() { return rng_.uniform_double(camera_, next_++); }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  template <class T>
  const T& one_of(const std::vector<T>& all, std::size_t first) {
    return all[at(rng_.below(static_cast<Index>(first), camera_, next_++))];
  }
  Vec3 direction() {
    const double z = 2 * uniform() - 1, azimuth = 2 * std::numbers::pi * uniform(),
                 across = std::sqrt(1 - z * z);
    return {across * std::cos(azimuth), across * std::sin(azimuth), z};
  }

 private:
  CounterRng rng_;
  std::uint64_t camera_, next_ = 0;
};

Vec3 novel_direction(const std::vector<Vec3>& directions, Draw& draw) {
  const Vec3& first = draw.one_of(directions, directions.size());
  std::vector<Vec3> nearest(directions);
  const std::size_t kept = std::min<std::size_t>(7, nearest.size());  // itself and six more
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(kept), nearest.end(),
                    [&](const Vec3& a, const Vec3& b) { return dot(a, first) > dot(b, first); });
  const Vec3 &second = draw.one_of(nearest, kept), &third = draw.one_of(nearest, kept);
  double u = draw.uniform(), v = draw.uniform();
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const Vec3 inside = (1 - u - v) * first + u * second + v * third;
  return norm(inside) > 1e-6 ? normalised(inside) : first;
}

// Draws a direction far enough from all training directions; if none is, returns the farthest drawn.
Vec3 extrapolated_direction(const std::vector<Vec3>& directions, Draw& draw) {
  const double far_enough = std::cos(std::numbers::pi / 6);
  Vec3 best{};
  double least = 2;  // cosine of the angle to the nearest training direction
  for (int i = 0; i < kTries && least > far_enough; ++i) {
    const Vec3 d = draw.direction();
    double nearest = -1;
    for (const Vec3& seen : directions) nearest = std::max(nearest, dot(seen, d));
    if (nearest < least) least = nearest, best = d;
  }
  return best;
}

// An axis-aligned box.
struct Box {
  Vec3 low, high;

  // The bounding box of the training cameras' positions.
  explicit Box(const CameraSpan& span)
      : low(span.centre + span.distances[0] * span.directions[0]), high(low) {
    for (std::size_t i = 1; i < span.directions.size(); ++i) {
      const Vec3 p = span.centre + span.distances[i] * span.directions[i];
      for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
    }
  }
  Vec3 point(Draw& draw) const {
    Vec3 p;
    for (std::size_t a = 0; a < 3; ++a) p[a] = draw.uniform(low[a], high[a]);
    return p;
  }
  // Draws a point outside the box, within one of twice its side lengths.
  Vec3 point_around(Draw& draw) const {
    Box twice = *this;
    for (std::size_t a = 0; a < 3; ++a) {
      const double half = 0.5 * (high[a] - low[a]);
      twice.low[a] -= half, twice.high[a] += half;
    }
    Vec3 p{};
    for (int i = 0; i < kTries; ++i) {
      p = twice.point(draw);
      for (std::size_t a = 0; a < 3; ++a)
        if (p[a] < low[a] || p[a] > high[a]) return p;
    }
    return p;
  }
};

Vec3 ring_direction(const Vec3& up, Draw& draw) {
  const double azimuth = 2 * std::numbers::pi * draw.uniform(), elevation = std::numbers::pi / 6;
  const Vec3 axis = std::abs(up[0]) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 x = normalised(axis - dot(axis, up) * up), y = cross(up, x);
  return std::cos(elevation) * (std::cos(azimuth) * x + std::sin(azimuth) * y) + std::sin(elevation) * up;
}

Pose draw_pose(const CameraSpan& span, CameraSet kind, Draw draw) {
  const Vec3& centre = span.centre;
  if (kind == CameraSet::ring)
    return look_at(centre + 4.0311 * ring_direction(span.up, draw), centre, span.up);
  const double distance = draw.one_of(span.distances, span.distances.size());
  if (kind == CameraSet::sphere) return look_at(centre + distance * draw.direction(), centre, span.up);
  if (kind == CameraSet::extrapolated)
    return look_at(span.forward_facing ? Box(span).point_around(draw)
                                       : centre + distance * extrapolated_direction(span.directions, draw),
                   centre, span.up);
  Vec3 eye;
  if (span.forward_facing) {
    eye = Box(span).point(draw);
    if (kind == CameraSet::closer) eye = centre + draw.uniform(0.8, 1) * (eye - centre);
    if (kind == CameraSet::farther) eye = centre + draw.uniform(1, 1.25) * (eye - centre);
  } else {
    const Vec3 direction = novel_direction(span.directions, draw);
    const double scale = kind == CameraSet::closer    ? draw.uniform(0.5, 0.8)
                         : kind == CameraSet::farther ? draw.uniform(1.5, 3)
                                                      : draw.uniform(0.8, 1.5);
    eye = centre + (distance * scale) * direction;
  }
  const Vec3 shift = (0.1 * span.half_size * std::cbrt(draw.uniform())) * draw.direction();
  return look_at(eye, centre + shift, span.up);
}

CameraSpan span_about(const Vec3& centre, std::span<const Camera> cameras, Background background) {
  CameraSpan span{.centre = centre,
                  .up = common_up(cameras),
                  .half_size = 0,
                  .directions = {},
                  .distances = {},
                  .background = background};
  for (const Camera& c : cameras) {
    const Vec3 from = c.position() - span.centre;
    const double distance = norm(from);
    if (!(distance > 1e-9)) continue;
    span.directions.push_back((1 / distance) * from);
    span.distances.push_back(distance);
    span.half_size = std::max(span.half_size, 1.05 * distance * 0.5 * static_cast<double>(c.width) / c.fx);
  }
  if (span.directions.empty())
    throw ValueError("[camera_span] cameras must stand around the point they look at, got all at that point");
  const Camera& c = cameras.front();
  const double w = static_cast<double>(c.width);
  span.fx = c.fx / w, span.fy = c.fy / w, span.cx = c.cx / w, span.cy = c.cy / w;
  span.width = c.width, span.height = c.height;
  return span;
}

// Returns the centre of a forward-facing capture, whose mean camera is at the origin.
Vec3 focus(const Dataset& data) {
  double near = 0, far = 0;
  for (const View& v : data.views) {
    if (!v.depth) continue;
    near = near > 0 ? std::min(near, v.depth->near) : v.depth->near;
    far = std::max(far, v.depth->far);
  }
  return {0, 0, near > 0 ? -1 / (0.25 / near + 0.75 / far) : -1};
}

}  // namespace

CameraSpan camera_span(std::span<const Camera> cameras, Background background) {
  if (cameras.empty()) throw ValueError("[camera_span] cameras must have at least one camera, got none");
  return span_about(look_at_point(cameras), cameras, background);
}

CameraSpan camera_span(const Dataset& dataset) {
  std::vector<Camera> cameras;
  for (const View& v : dataset.views) cameras.push_back(v.camera);
  if (dataset.scene != SceneType::forward) return camera_span(cameras, dataset.background);
  CameraSpan span = span_about(focus(dataset), cameras, dataset.background);
  span.forward_facing = true;
  return span;
}

std::vector<std::string> camera_set_names() {
  std::vector<std::string> names;
  for (const auto& [name, set] : kSets) names.emplace_back(name);
  return names;
}

CameraSet parse_camera_set(std::string_view name) {
  for (const auto& [known, set] : kSets)
    if (name == known) return set;
  throw ValueError(
      "[cameras] set must be novel, ring, sphere, extrapolated, closer, farther or test, got \"" +
      std::string(name) + "\"");
}

std::vector<Camera> make_cameras(const CameraSpan& span, CameraSet kind, Index count, Index size,
                                 std::uint64_t seed) {
  if (kind == CameraSet::test)
    throw ValueError(
        "[make_cameras] kind must be drawn from the span (test views are in the data set), got test");
  if (count < 0 || size < 0)
    throw ValueError("[make_cameras] count and size must not be negative, got " + std::to_string(count) +
                     " and " + std::to_string(size));
  if (span.directions.empty() || span.directions.size() != span.distances.size())
    throw ValueError("[make_cameras] span must have as many distances as directions and at least one, got " +
                     std::to_string(span.distances.size()) + " and " +
                     std::to_string(span.directions.size()));
  const double w = static_cast<double>(span.width);
  const Camera base{.pose = {},
                    .fx = span.fx * w,
                    .fy = span.fy * w,
                    .cx = span.cx * w,
                    .cy = span.cy * w,
                    .width = span.width,
                    .height = span.height};
  std::vector<Camera> cameras(at(count), base.scaled(size));
  for (Index i = 0; i < count; ++i) cameras[at(i)].pose = draw_pose(span, kind, Draw(seed, kind, i));
  return cameras;
}

std::string format_camera_span(const CameraSpan& s) {
  nlohmann::json json{{"centre", s.centre},
                      {"up", s.up},
                      {"half_size", s.half_size},
                      {"directions", s.directions},
                      {"distances", s.distances},
                      {"intrinsics", {s.fx, s.fy, s.cx, s.cy}},
                      {"width", s.width},
                      {"height", s.height},
                      {"background", s.background == Background::white ? "white" : "black"}};
  if (s.forward_facing) json["forward_facing"] = true;
  return json.dump();
}

CameraSpan parse_camera_span(std::string_view text, std::string_view where) {
  const nlohmann::json json = parse_json(text, where);
  const JsonPlace root(json, std::string(where));
  const auto length = [](const JsonPlace& value) { return value.number_in(0, 1e12, "(0, 1e12)"); };
  const auto unit = [](const JsonPlace& value) {
    const Vec3 v = value.vec3();
    if (!(std::abs(norm(v) - 1) < 1e-6)) value.fail("a unit vector", "length " + number_text(norm(v)));
    return v;
  };
  CameraSpan s{.centre = root["centre"].vec3(),
               .up = unit(root["up"]),
               .half_size = length(root["half_size"]),
               .directions = {},
               .distances = {}};
  const JsonPlace directions = root["directions"], distances = root["distances"];
  const std::size_t count = directions.array_size();
  if (count == 0 || distances.array_size() != count)
    distances.fail("as many numbers as directions, at least one", std::to_string(distances.array_size()));
  for (std::size_t i = 0; i < count; ++i) {
    s.directions.push_back(unit(directions.at(i)));
    s.distances.push_back(length(distances.at(i)));
  }
  const JsonPlace k = root["intrinsics"];
  if (k.array_size() != 4) k.fail("4 numbers", std::to_string(k.array_size()));
  s.fx = length(k.at(0)), s.fy = length(k.at(1)), s.cx = k.at(2).number(), s.cy = k.at(3).number();
  s.width = root["width"].side(), s.height = root["height"].side();
  const std::string background = root["background"].text();
  if (background != "white" && background != "black") root["background"].fail("white or black", background);
  s.background = background == "white" ? Background::white : Background::black;
  s.forward_facing = json.value("forward_facing", false);
  return s;
}

}  // namespace fieldmark::nerf
