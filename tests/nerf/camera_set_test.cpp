#include <fieldmark/core/error.h>
#include <fieldmark/nerf/camera_set.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
const Vec3 kCentre{0.3, -0.2, 0.1};
double dot3(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 minus(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double length(const Vec3& a) { return std::sqrt(dot3(a, a)); }

// Cameras on the cap above 20 degrees around kCentre, at distances from 3 to 5.
std::vector<Camera> cap(Index count) {
  const auto r = uniform({count, 3}, 0, 1, 4);
  std::vector<Camera> cameras;
  for (Index i = 0; i < count; ++i) {
    const double z = 0.342 + 0.65 * r[3 * i], a = 6.28 * r[3 * i + 1], d = 3 + 2 * r[3 * i + 2],
                 w = std::sqrt(1 - z * z);
    const Vec3 eye{kCentre[0] + d * w * std::cos(a), kCentre[1] + d * w * std::sin(a), kCentre[2] + d * z};
    cameras.push_back(make_camera(look_at(eye, kCentre, {0, 0, 1}), 0.7, 80, 60));
  }
  return cameras;
}
// Returns the distance of the point from the camera's axis.
double off_axis(const Camera& c, const Vec3& p) {
  const Vec3 to = minus(p, c.position());
  const double square = dot3(to, to) - std::pow(dot3(to, c.forward()), 2);
  return square < 0 ? 0 : std::sqrt(square);  // keeps a NaN
}
}  // namespace

TEST_CASE("camera_set: the span of cameras far from the origin is that of cameras near it, moved") {
  const auto near = cap(30);
  const CameraSpan here = camera_span(near, Background::black);
  for (const double shift : {5e5, 1e7}) {
    const Vec3 moved{shift, -0.5 * shift, 2 * shift};
    auto far = near;
    for (Camera& c : far)
      for (std::size_t a = 0; a < 3; ++a) c.pose[4 * a + 3] += moved[a];
    const CameraSpan there = camera_span(far, Background::black);
    for (std::size_t a = 0; a < 3; ++a) {
      CHECK(std::abs(there.centre[a] - moved[a] - here.centre[a]) < 1e-6);
      CHECK(std::abs(there.up[a] - here.up[a]) < 1e-9);
    }
    CHECK(std::abs(there.half_size - here.half_size) < 1e-6);
    for (std::size_t i = 0; i < near.size(); ++i)
      CHECK(std::abs(there.distances[i] - here.distances[i]) < 1e-6);
  }
}

TEST_CASE("camera_set: the span finds centre, up and distances of the cameras it is given") {
  const auto cameras = cap(30);
  const CameraSpan s = camera_span(cameras, Background::black);
  CHECK(length(minus(s.centre, kCentre)) < 1e-7);
  CHECK(length(minus(s.up, {0, 0, 1})) < 1e-7);
  REQUIRE(s.directions.size() == 30);
  for (std::size_t i = 0; i < 30; ++i) {
    CHECK(std::abs(s.distances[i] - length(minus(cameras[i].position(), kCentre))) < 1e-7);
    CHECK(dot3(s.directions[i], cameras[i].forward()) < -0.999999);
  }
  const double far = *std::max_element(s.distances.begin(), s.distances.end());
  CHECK(std::abs(s.half_size - 1.05 * far * std::tan(0.35)) < 1e-9);
  CHECK((s.width == 80 && s.height == 60 && std::abs(s.cy - 0.375) < 1e-15));
}

TEST_CASE("camera_set: one camera spans itself") {
  const CameraSpan s = camera_span(cap(1), Background::white);
  CHECK(length(s.centre) < length(cap(1)[0].position()));
  for (const Camera& c : make_cameras(s, CameraSet::novel, 5, 0, 1))
    CHECK(dot3(minus(c.position(), s.centre), s.directions[0]) > 0.79 * s.distances[0]);
}

TEST_CASE("camera_set: novel stays inside directions, distances and look-at of training") {
  const CameraSpan s = camera_span(cap(60), Background::white);
  const auto cameras = make_cameras(s, CameraSet::novel, 300, 40, 9);
  REQUIRE(cameras.size() == 300);
  const auto [low, high] = std::minmax_element(s.distances.begin(), s.distances.end());
  double nearest = 1e9, farthest = 0, aside = 0;
  for (const Camera& c : cameras) {
    const Vec3 from = minus(c.position(), s.centre);
    CHECK(from[2] / length(from) > 0.34);  // a cap is convex
    nearest = std::min(nearest, length(from)), farthest = std::max(farthest, length(from));
    raise_to(aside, off_axis(c, s.centre));
    CHECK((c.width == 40 && c.height == 30));
    CHECK(c.pose[9] > 0);  // up stays up
  }
  CHECK(nearest >= 0.8 * *low - 1e-9);
  CHECK(nearest < 1.1 * *low);
  CHECK(farthest <= 1.5 * *high + 1e-9);
  CHECK(farthest > 1.2 * *high);
  CHECK(aside <= 0.1 * s.half_size);
  CHECK(aside > 0.06 * s.half_size);
}

TEST_CASE("camera_set: ring and sphere") {
  const CameraSpan s = camera_span(cap(20), Background::white);
  Vec3 mean{}, sphere_mean{};
  for (const Camera& c : make_cameras(s, CameraSet::ring, 400, 0, 3)) {
    const Vec3 from = minus(c.position(), s.centre);
    CHECK(std::abs(length(from) - 4.0311) < 1e-12);
    CHECK(std::abs(from[2] / 4.0311 - 0.5) < 1e-6);
    CHECK(off_axis(c, s.centre) < 1e-6);
    for (std::size_t k = 0; k < 3; ++k) mean[k] += from[k] / 4.0311 / 400;
  }
  for (const Camera& c : make_cameras(s, CameraSet::sphere, 400, 0, 3)) {
    const Vec3 from = minus(c.position(), s.centre);
    for (std::size_t k = 0; k < 3; ++k) sphere_mean[k] += from[k] / length(from) / 400;
  }
  CHECK(std::hypot(mean[0], mean[1]) < 0.13);  // 3 standard deviations for 400 azimuths
  CHECK(length(sphere_mean) < 0.15);           // 3 standard deviations for 400 directions
}

TEST_CASE("camera_set: closer and farther are novel ones at other distances") {
  const CameraSpan s = camera_span(cap(60), Background::white);
  const auto [low, high] = std::minmax_element(s.distances.begin(), s.distances.end());
  const auto check = [&](CameraSet kind, double least, double most) {
    double nearest = 1e9, farthest = 0;
    for (const Camera& c : make_cameras(s, kind, 300, 0, 9)) {
      const Vec3 from = minus(c.position(), s.centre);
      CHECK(from[2] / length(from) > 0.34);
      CHECK(off_axis(c, s.centre) <= 0.1 * s.half_size);
      nearest = std::min(nearest, length(from)), farthest = std::max(farthest, length(from));
    }
    CAPTURE(nearest, farthest);
    CHECK((nearest >= least * *low - 1e-9 && nearest < 1.25 * least * *low));
    CHECK((farthest <= most * *high + 1e-9 && farthest > 0.8 * most * *high));
  };
  check(CameraSet::closer, 0.5, 0.8);
  check(CameraSet::farther, 1.5, 3);
}

TEST_CASE("camera_set: extrapolated cameras look from where no training camera was") {
  const CameraSpan s = camera_span(cap(60), Background::white);
  const auto nearest = [&](const Camera& c) {
    double most = -1;
    for (const Vec3& d : s.directions) raise_to(most, -dot3(d, c.forward()));
    return std::acos(most) * 180 / 3.14159265358979;
  };
  double widest = 0;
  for (const Camera& c : make_cameras(s, CameraSet::extrapolated, 100, 0, 3)) {
    CHECK(nearest(c) > 30);
    CHECK(off_axis(c, s.centre) < 1e-6);
    raise_to(widest, nearest(c));
  }
  CHECK(widest > 90);  // no camera saw the cap below
  // Cameras all around leave no such direction, so the farthest of the drawn ones are used.
  CameraSpan all = s;
  all.directions.clear();
  for (const Camera& c : make_cameras(s, CameraSet::sphere, 400, 0, 5)) {
    const Vec3 f = c.forward();
    all.directions.push_back({-f[0], -f[1], -f[2]});
  }
  all.distances.assign(400, 4);
  for (const Camera& c : make_cameras(all, CameraSet::extrapolated, 5, 0, 3)) {
    double most = -1;
    for (const Vec3& d : all.directions) raise_to(most, -dot3(d, c.forward()));
    CHECK(most < std::cos(0.1));
  }
}

TEST_CASE("camera_set: names and sets belong together") {
  const auto names = camera_set_names();
  CHECK(names.size() == 7);
  CHECK(names.front() == "novel");
  for (const auto& name : names) CHECK_NOTHROW(parse_camera_set(name));
  CHECK(parse_camera_set("extrapolated") == CameraSet::extrapolated);
  CHECK(parse_camera_set("farther") == CameraSet::farther);
}

TEST_CASE("camera_set: camera i depends on the seed and i only") {
  const CameraSpan s = camera_span(cap(20), Background::white);
  for (const CameraSet kind : {CameraSet::novel, CameraSet::ring, CameraSet::sphere, CameraSet::closer,
                               CameraSet::farther, CameraSet::extrapolated}) {
    const auto few = make_cameras(s, kind, 3, 0, 5), many = make_cameras(s, kind, 10, 0, 5);
    for (std::size_t i = 0; i < 3; ++i) CHECK(few[i].pose == many[i].pose);
    CHECK(few[0].pose != few[1].pose);
    CHECK(make_cameras(s, kind, 1, 0, 6)[0].pose != few[0].pose);
  }
}

TEST_CASE("camera_set: the span survives its JSON text bit for bit") {
  const CameraSpan s = camera_span(cap(7), Background::black);
  const CameraSpan b = parse_camera_span(format_camera_span(s), "x");
  CHECK((b.centre == s.centre && b.up == s.up && b.half_size == s.half_size && b.directions == s.directions));
  CHECK((b.distances == s.distances && b.fx == s.fx && b.fy == s.fy && b.cx == s.cx && b.cy == s.cy));
  CHECK((b.width == s.width && b.height == s.height && b.background == s.background));
}

TEST_CASE("camera_set: errors") {
  CHECK_THROWS_WITH(camera_span(std::vector<Camera>{}, Background::white),
                    Contains("at least one camera, got none"));
  CHECK_THROWS_WITH(
      parse_camera_set("far"),
      "[cameras] set must be novel, ring, sphere, extrapolated, closer, farther or test, got \"far\"");
  CHECK(parse_camera_set("test") == CameraSet::test);
  const CameraSpan s = camera_span(cap(2), Background::white);
  CHECK_THROWS_WITH(make_cameras(s, CameraSet::test, 1, 0, 0), Contains("test views are in the data set"));
  CHECK_THROWS_WITH(make_cameras(s, CameraSet::novel, -1, 0, 0),
                    Contains("must not be negative, got -1 and 0"));
  CHECK_THROWS_WITH(make_cameras(CameraSpan{}, CameraSet::novel, 1, 0, 0), Contains("got 0 and 0"));
  CHECK_THROWS_WITH(parse_camera_span("{}", "f.safetensors: cameras"),
                    "f.safetensors: cameras: expected the key \"centre\", got none");
  std::string text = format_camera_span(s);
  text.replace(text.find("\"white\""), 7, "\"green\"");
  CHECK_THROWS_WITH(parse_camera_span(text, "f"), "f: background: expected white or black, got green");
  CHECK_THROWS_AS(parse_camera_span("{\"centre\": [1, 2]}", "f"), IoError);
}

TEST_CASE("camera_set: novel cameras of a forward-facing capture stand in the box of its path") {
  Dataset data;
  data.scene = SceneType::forward;
  const auto u = uniform({9, 3}, -1, 1, 8);
  for (Index i = 0; i < 9; ++i) {
    const Pose pose{1, 0, 0, 0.5 * u[3 * i], 0, 1, 0, 0.3 * u[3 * i + 1], 0, 0, 1, 0.1 * u[3 * i + 2]};
    data.views.push_back(
        {.camera = make_camera(pose, 0.9, 40, 30), .rgba = {}, .name = {}, .depth = DepthRange{2, 8}});
  }
  const CameraSpan span = parse_camera_span(format_camera_span(camera_span(data)), "here");
  CHECK(span.forward_facing);
  CHECK(std::abs(span.centre[2] + 1 / (0.25 / 2 + 0.75 / 8)) < 1e-12);
  Vec3 low{}, high{};
  for (const View& v : data.views)
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], v.camera.position()[a]);
      high[a] = std::max(high[a], v.camera.position()[a]);
    }
  Vec3 reached{};
  for (const Camera& c : make_cameras(span, CameraSet::novel, 100, 0, 3)) {
    for (std::size_t a = 0; a < 3; ++a) {
      CHECK((c.position()[a] >= low[a] - 1e-12 && c.position()[a] <= high[a] + 1e-12));
      reached[a] = std::max(reached[a], c.position()[a]);
    }
    CHECK(c.forward()[2] < -0.9);
    CHECK(off_axis(c, span.centre) < 0.1 * span.half_size + 1e-9);
  }
  for (std::size_t a = 0; a < 3; ++a) CHECK(reached[a] > 0.8 * high[a]);
  const auto inside = [&](const Vec3& p) {
    for (std::size_t a = 0; a < 3; ++a)
      if (p[a] < low[a] - 1e-12 || p[a] > high[a] + 1e-12) return false;
    return true;
  };
  for (const Camera& c : make_cameras(span, CameraSet::extrapolated, 50, 0, 3)) {
    CHECK_FALSE(inside(c.position()));
    for (std::size_t a = 0; a < 3; ++a)
      CHECK(std::abs(c.position()[a] - 0.5 * (low[a] + high[a])) <= high[a] - low[a] + 1e-12);
  }
  const double depth = -span.centre[2];
  for (const Camera& c : make_cameras(span, CameraSet::closer, 50, 0, 3))
    CHECK((c.position()[2] < high[2] && c.position()[2] > -0.2 * depth + low[2]));
  for (const Camera& c : make_cameras(span, CameraSet::farther, 50, 0, 3))
    CHECK((c.position()[2] > low[2] && c.position()[2] < 0.25 * depth + 1.25 * high[2]));
}
