#include <fieldmark/engine/random.h>
#include <fieldmark/nerf/camera_set.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "json_place.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {
using Mat3 = std::array<Vec3, 3>;  // symmetric, rows

constexpr int kTries = 256;
const double kUnseen = std::cos(std::numbers::pi / 6);  // of a direction that no training camera had

void add_outer(Mat3& m, double scale, const Vec3& v) {
  for (std::size_t i = 0; i < 3; ++i) m[i] = m[i] + (scale * v[i]) * v;
}

// (m + ridge I)^-1 b by Cramer's rule; the ridge decides only where m does not.
Vec3 solve(Mat3 m, const Vec3& b, double ridge) {
  for (std::size_t i = 0; i < 3; ++i) m[i][i] += ridge;
  const Vec3 a = cross(m[1], m[2]), c = cross(m[2], m[0]), d = cross(m[0], m[1]);
  return (1 / dot(m[0], a)) * (b[0] * a + b[1] * c + b[2] * d);
}

// The point with the least sum of squared distances to the viewing axes: sum (I - f f^T) (p - o) = 0.
// Parallel axes leave it open along them; then it is where they pass the origin.
Vec3 look_at_point(std::span<const Camera> cameras) {
  Mat3 m{};
  Vec3 b{};
  for (const Camera& c : cameras) {
    const Vec3 f = normalised(c.forward()), o = c.position();
    for (std::size_t i = 0; i < 3; ++i) m[i][i] += 1;
    add_outer(m, -1, f);
    b = b + o - dot(f, o) * f;
  }
  return solve(m, b, 1e-9 * static_cast<double>(cameras.size()));
}

// One step of inverse iteration on sum x x^T from the mean y axis: the direction most at right angles to the
// x axes.
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

// Numbers of camera i of a set.
class Draw {
 public:
  Draw(std::uint64_t seed, CameraSet kind, Index camera)
      : rng_(seed, 0x63616D00u + static_cast<std::uint64_t>(kind)),
        camera_(static_cast<std::uint64_t>(camera)) {}
  double uniform() { return rng_.uniform_double(camera_, next_++); }
  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>(rng_.below(static_cast<Index>(n), camera_, next_++));
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

Vec3 near_direction(const std::vector<Vec3>& directions, Draw& draw) {
  const Vec3& first = directions[draw.below(directions.size())];
  std::vector<Vec3> nearest(directions);
  const std::size_t kept = std::min<std::size_t>(7, nearest.size());  // itself and six more
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(kept), nearest.end(),
                    [&](const Vec3& a, const Vec3& b) { return dot(a, first) > dot(b, first); });
  const Vec3 &second = nearest[draw.below(kept)], &third = nearest[draw.below(kept)];
  double u = draw.uniform(), v = draw.uniform();
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const Vec3 inside = (1 - u - v) * first + u * second + v * third;
  return norm(inside) > 1e-6 ? normalised(inside) : first;
}

struct Box {
  Vec3 low, high;
};

// Along the world's axes, around the positions of the cameras.
Box box_of(const CameraSpan& span) {
  Box box{};
  for (std::size_t i = 0; i < span.directions.size(); ++i) {
    const Vec3 p = span.centre + span.distances[i] * span.directions[i];
    for (std::size_t a = 0; a < 3; ++a) {
      box.low[a] = i == 0 ? p[a] : std::min(box.low[a], p[a]);
      box.high[a] = i == 0 ? p[a] : std::max(box.high[a], p[a]);
    }
  }
  return box;
}

Vec3 in_box(const Box& box, Draw& draw) {
  Vec3 eye;
  for (std::size_t a = 0; a < 3; ++a) eye[a] = box.low[a] + (box.high[a] - box.low[a]) * draw.uniform();
  return eye;
}

// In the box grown to twice its sides, outside of it.
Vec3 around_box(const Box& box, Draw& draw) {
  Box twice;
  for (std::size_t a = 0; a < 3; ++a) {
    const double half = 0.5 * (box.high[a] - box.low[a]);
    twice.low[a] = box.low[a] - half, twice.high[a] = box.high[a] + half;
  }
  Vec3 eye{};
  for (int i = 0; i < kTries; ++i) {
    eye = in_box(twice, draw);
    for (std::size_t a = 0; a < 3; ++a)
      if (eye[a] < box.low[a] || eye[a] > box.high[a]) return eye;
  }
  return eye;
}

Vec3 unseen_direction(const std::vector<Vec3>& directions, Draw& draw) {
  Vec3 best{};
  double least = 2;  // cosine of the angle to the nearest training direction
  for (int i = 0; i < kTries && least > kUnseen; ++i) {
    const Vec3 d = draw.direction();
    double nearest = -1;
    for (const Vec3& seen : directions) nearest = std::max(nearest, dot(seen, d));
    if (nearest < least) least = nearest, best = d;
  }
  return best;
}

struct Range {
  double low, high;
  double at(double u) const { return low + (high - low) * u; }
};

// Of the training cameras' distances.
Range distances_of(CameraSet kind, bool forward_facing) {
  if (kind == CameraSet::closer) return forward_facing ? Range{0.8, 1} : Range{0.5, 0.8};
  if (kind == CameraSet::farther) return forward_facing ? Range{1, 1.25} : Range{1.5, 3};
  return forward_facing ? Range{1, 1} : Range{0.8, 1.5};
}

Pose ring_pose(const CameraSpan& span, Draw& draw) {
  const double azimuth = 2 * std::numbers::pi * draw.uniform(), elevation = std::numbers::pi / 6;
  const Vec3 axis = std::abs(span.up[0]) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 x = normalised(axis - dot(axis, span.up) * span.up), y = cross(span.up, x);
  const Vec3 d =
      std::cos(elevation) * (std::cos(azimuth) * x + std::sin(azimuth) * y) + std::sin(elevation) * span.up;
  return look_at(span.centre + 4.0311 * d, span.centre, span.up);
}

Pose draw_pose(const CameraSpan& span, CameraSet kind, Draw draw) {
  if (kind == CameraSet::ring) return ring_pose(span, draw);
  const double distance = span.distances[draw.below(span.distances.size())];
  if (kind == CameraSet::sphere)
    return look_at(span.centre + distance * draw.direction(), span.centre, span.up);
  if (kind == CameraSet::extrapolated)
    return look_at(span.forward_facing ? around_box(box_of(span), draw)
                                       : span.centre + distance * unseen_direction(span.directions, draw),
                   span.centre, span.up);
  const Range range = distances_of(kind, span.forward_facing);
  Vec3 eye;
  if (span.forward_facing) {
    eye = in_box(box_of(span), draw);
    if (kind != CameraSet::novel) eye = span.centre + range.at(draw.uniform()) * (eye - span.centre);
  } else {
    const Vec3 direction = near_direction(span.directions, draw);
    eye = span.centre + (distance * range.at(draw.uniform())) * direction;
  }
  const Vec3 shift = (0.1 * span.half_size * std::cbrt(draw.uniform())) * draw.direction();
  return look_at(eye, span.centre + shift, span.up);
}
}  // namespace

namespace {

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
    throw ValueError("[camera_span] cameras must stand around what they look at, got all at one point");
  const Camera& c = cameras.front();
  const double w = static_cast<double>(c.width);
  span.fx = c.fx / w, span.fy = c.fy / w, span.cx = c.cx / w, span.cy = c.cy / w;
  span.width = c.width, span.height = c.height;
  return span;
}

// Where a forward-facing capture looks, its mean camera being at the origin.
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
  if (!dataset.forward_facing) return camera_span(cameras, dataset.background);
  CameraSpan span = span_about(focus(dataset), cameras, dataset.background);
  span.forward_facing = true;
  return span;
}

namespace {
constexpr std::pair<const char*, CameraSet> kSets[]{
    {"novel", CameraSet::novel},   {"ring", CameraSet::ring},
    {"sphere", CameraSet::sphere}, {"extrapolated", CameraSet::extrapolated},
    {"closer", CameraSet::closer}, {"farther", CameraSet::farther},
    {"test", CameraSet::test}};
}  // namespace

std::vector<std::string> camera_set_names() {
  std::vector<std::string> names;
  for (const auto& [name, set] : kSets) names.emplace_back(name);
  return names;
}

CameraSet parse_camera_set(std::string_view name) {
  for (const auto& [known, set] : kSets)
    if (name == known) return set;
  throw ValueError("[cameras] set must be near, ring, sphere, unseen, closer, farther or test, got \"" +
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
  Camera base{.pose = {},
              .fx = span.fx * w,
              .fy = span.fy * w,
              .cx = span.cx * w,
              .cy = span.cy * w,
              .width = span.width,
              .height = span.height};
  base = base.scaled(size);
  std::vector<Camera> cameras(static_cast<std::size_t>(count), base);
  for (Index i = 0; i < count; ++i)
    cameras[static_cast<std::size_t>(i)].pose = draw_pose(span, kind, Draw(seed, kind, i));
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
  constexpr double kMost = 1e12;
  CameraSpan s{.centre = root["centre"].vec3(),
               .up = root["up"].vec3(),
               .half_size = root["half_size"].number_in(0, kMost, "(0, 1e12)"),
               .directions = {},
               .distances = {}};
  if (!(std::abs(norm(s.up) - 1) < 1e-6))
    root["up"].fail("a unit vector", "length " + std::to_string(norm(s.up)));
  const JsonPlace directions = root["directions"], distances = root["distances"];
  const std::size_t count = directions.array_size();
  if (count == 0 || distances.array_size() != count)
    distances.fail("as many numbers as directions, at least one", std::to_string(distances.array_size()));
  for (std::size_t i = 0; i < count; ++i) {
    s.directions.push_back(directions.at(i).vec3());
    const double length = norm(s.directions.back());
    if (!(std::abs(length - 1) < 1e-6))
      directions.at(i).fail("a unit vector", "length " + std::to_string(length));
    s.distances.push_back(distances.at(i).number_in(0, kMost, "(0, 1e12)"));
  }
  const JsonPlace k = root["intrinsics"];
  if (k.array_size() != 4) k.fail("4 numbers", std::to_string(k.array_size()));
  s.fx = k.at(0).number_in(0, kMost, "(0, 1e12)"), s.fy = k.at(1).number_in(0, kMost, "(0, 1e12)");
  s.cx = k.at(2).number(), s.cy = k.at(3).number();
  s.width = std::lround(root["width"].number_in(0.5, 65536.5, "1 to 65536"));
  s.height = std::lround(root["height"].number_in(0.5, 65536.5, "1 to 65536"));
  const std::string background = root["background"].text();
  if (background != "white" && background != "black") root["background"].fail("white or black", background);
  s.background = background == "white" ? Background::white : Background::black;
  s.forward_facing = json.value("forward_facing", false);
  return s;
}

}  // namespace fieldmark::nerf
