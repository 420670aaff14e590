#include "cli/camera_path.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::cli;
using std::numbers::pi;

namespace {

Eigen::Vector3d vec(const nerf::Vec3& v) { return {v[0], v[1], v[2]}; }

// Cameras at a height of 30 degrees, at these azimuths, two units from (1, 2, 3).
nerf::CameraSpan around(const std::vector<double>& azimuths) {
  nerf::CameraSpan span{
      .centre = {1, 2, 3}, .directions = {}, .distances = {}, .cy = 0.25, .width = 40, .height = 20};
  for (const double a : azimuths) {
    span.directions.push_back({std::cos(pi / 6) * std::cos(a), std::cos(pi / 6) * std::sin(a), 0.5});
    span.distances.push_back(2);
  }
  return span;
}

double azimuth(const nerf::Camera& c, const nerf::CameraSpan& span) {
  const Eigen::Vector3d from = vec(c.position()) - vec(span.centre);
  return std::atan2(from[1], from[0]);
}

std::string error_of(const std::string& text) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "path.json", text);
  try {
    read_camera_path(folder / "path.json", around({0}), 0);
  } catch (const IoError& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("camera_path: an orbit is a circle at the height of cameras from all around", "[render]") {
  const nerf::CameraSpan span = around({0, 1, 2, 3, 4, 5});
  const auto cameras = orbit(span, 8, 80);
  REQUIRE(cameras.size() == 8);
  for (std::size_t i = 0; i < 8; ++i) {
    const nerf::Camera& c = cameras[i];
    const Eigen::Vector3d from = vec(c.position()) - vec(span.centre);
    CHECK(from.norm() == Approx(2));
    CHECK(from[2] == Approx(1));  // the cameras' height
    CHECK((vec(c.forward()) + from / 2).norm() < 1e-12);
    CHECK(c.pose[9] > 0);  // upright
    CHECK(c.width == 80);
    CHECK(c.height == 40);
    const double turn = azimuth(cameras[(i + 1) % 8], span) - azimuth(c, span);
    CHECK(std::abs(std::cos(turn) - std::sqrt(0.5)) < 1e-12);
  }
}

TEST_CASE("camera_path: an orbit stays where cameras were, also across the seam of azimuths", "[render]") {
  for (const double middle : {0.0, 2.0, pi}) {
    const nerf::CameraSpan span = around({middle - 0.5, middle, middle + 0.5});
    double widest = 0;
    for (const nerf::Camera& c : orbit(span, 64, 0)) {
      const double off = std::abs(std::remainder(azimuth(c, span) - middle, 2 * pi));
      CHECK(off < 0.4501);
      widest = std::max(widest, off);
    }
    CHECK(widest == Approx(0.45).epsilon(1e-3));
  }
}

TEST_CASE("camera_path: cameras straight above say nothing about sides", "[render]") {
  nerf::CameraSpan span = around({-1.7, -1, 0, 1, 1.7});  // leaves 165 degrees out
  span.directions.push_back({std::cos(pi) * 1e-9, 0, 1});
  span.distances.push_back(2);
  for (const nerf::Camera& c : orbit(span, 32, 0)) CHECK(std::abs(azimuth(c, span)) < 1.54);
  nerf::CameraSpan above{
      .centre = {0, 0, 0}, .directions = {{0, 0, 1}}, .distances = {3}, .width = 4, .height = 4};
  for (const nerf::Camera& c : orbit(above, 3, 0))
    CHECK(c.position()[2] == Approx(3 * std::sin(75 * pi / 180)));
}

TEST_CASE("camera_path: an orbit of a forward-facing capture is an ellipse among its cameras", "[render]") {
  nerf::CameraSpan span{
      .centre = {0, 0, -4}, .up = {0, 1, 0}, .directions = {}, .distances = {}, .width = 4, .height = 3};
  span.forward_facing = true;
  for (const double x : {-1.0, 1.0})
    for (const double y : {-0.5, 0.5}) {
      const Eigen::Vector3d from(x, y, 4), d = from.normalized();
      span.directions.push_back({d[0], d[1], d[2]});
      span.distances.push_back(from.norm());
    }
  const auto cameras = orbit(span, 4, 0);
  const double expected[4][2] = {{0, 0.25}, {0.5, 0}, {0, -0.25}, {-0.5, 0}};
  for (std::size_t i = 0; i < 4; ++i) {
    const nerf::Vec3 p = cameras[i].position();
    CHECK(p[0] == Approx(expected[i][0]).margin(1e-12));
    CHECK(p[1] == Approx(expected[i][1]).margin(1e-12));
    CHECK(p[2] == Approx(0).margin(1e-12));
    CHECK((vec(span.centre) - vec(p)).normalized().dot(vec(cameras[i].forward())) == Approx(1));
  }
}

TEST_CASE("camera_path: a grid has all heights of the training cameras, the highest first", "[render]") {
  nerf::CameraSpan span = around({0, 1, 2, 3, 4, 5});
  span.directions.push_back({0, 0, 1});  // from above: taken at 75 degrees
  span.distances.push_back(2);
  const CameraGrid grid = camera_grid(span, 3, 4, 8);
  CHECK(grid.closed);
  REQUIRE(grid.cameras.size() == 12);
  for (std::size_t i = 0; i < 12; ++i) {
    const double degrees[] = {75, 52.5, 30};
    CHECK(grid.cameras[i].position()[2] - 3 == Approx(2 * std::sin(degrees[i / 4] * pi / 180)));
    const double turn = azimuth(grid.cameras[i / 4 * 4 + (i + 1) % 4], span) - azimuth(grid.cameras[i], span);
    CHECK(std::abs(std::cos(turn)) < 1e-12);
  }
  const CameraGrid arc = camera_grid(around({1, 1.5, 2}), 1, 3, 8);
  CHECK_FALSE(arc.closed);
  CHECK(azimuth(arc.cameras[0], span) == Approx(1.05));
  CHECK(azimuth(arc.cameras[2], span) == Approx(1.95));
}

TEST_CASE("camera_path: a file has cameras of transforms.json", "[render]") {
  const TemporaryFolder folder;
  const nerf::CameraSpan span = around({0});
  write_file_atomically(folder / "path.json", R"({"camera_angle_x": 1.0, "frames": [
    {"transform_matrix": [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]},
    {"file_path": "x", "transform_matrix": [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]]}]})");
  const auto cameras = read_camera_path(folder / "path.json", span, 10);
  REQUIRE(cameras.size() == 2);
  CHECK(cameras[0].position() == nerf::Vec3{5, 6, 7});
  CHECK(cameras[1].pose == nerf::Pose{0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3});
  CHECK(cameras[0].width == 10);
  CHECK(cameras[0].fx == Approx(5 / std::tan(0.5)));
  write_file_atomically(folder / "lens.json", R"({"w": 60, "h": 40, "fl_x": 50, "frames": [
    {"cx": 31, "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]},
    {"fl_y": 55, "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}]})");
  const auto lens = read_camera_path(folder / "lens.json", span, 0);
  CHECK(lens[0].parameters() == std::array<double, 16>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 50, 50, 31, 20});
  CHECK(lens[1].parameters() == std::array<double, 16>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 50, 55, 30, 20});
  CHECK(read_camera_path(folder / "lens.json", span, 30)[1].fy == 27.5);
  write_file_atomically(folder / "own.json",
                        R"({"frames": [{"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]})");
  CHECK(read_camera_path(folder / "own.json", span, 0)[0].fx == 40);  // the span's
}

TEST_CASE("camera_path: a bad file is refused, and its place named", "[render]") {
  const auto refused = [](const std::string& text, const std::string& expected) {
    const std::string error = error_of(text);
    CHECK_THAT(error, Contains("path.json: "));
    CHECK_THAT(error, Contains(expected));
  };
  refused("{", "expected JSON with \"frames\"");
  refused("[]", "frames: expected a list of cameras");
  refused(R"({"frames": []})", "found an array of 0");
  refused(R"({"frames": [7]})", "frames[0].transform_matrix: expected 3 or 4 rows, found nothing");
  refused(R"({"frames": [{"transform_matrix": [[1,0,0,0],[0,1,0],[0,0,1,0]]}]})",
          "frames[0].transform_matrix[1]: expected 4 numbers, found an array of 3");
  refused(R"({"frames": [{"transform_matrix": [[1,0,0,0],[0,"a",0,0],[0,0,1,0]]}]})",
          "frames[0].transform_matrix[1][1]: expected a number below 1e9, found \"a\"");
  refused(R"({"frames": [{"transform_matrix": [[2,0,0,0],[0,1,0,0],[0,0,1,0]]}]})", "expected a rotation");
  refused(R"({"frames": [{"transform_matrix": [[-1,0,0,0],[0,1,0,0],[0,0,1,0]]}]})", "expected a rotation");
  refused(R"({"camera_angle_x": 4, "frames": [{"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]})",
          "camera_angle_x: expected a number from 0.001 to 3.14, found 4");
  const std::string identity = R"([[1,0,0,0],[0,1,0,0],[0,0,1,0])";
  refused(R"({"frames": [{"transform_matrix": )" + identity + "]}, {\"transform_matrix\": " + identity +
              ", [0,0,0,2]]}]}",
          "frames[1].transform_matrix[3]: expected 0, 0, 0, 1, found an array of 4");
  refused(R"({"frames": [{"fl_x": -1, "transform_matrix": )" + identity + "]}]}",
          "frames[0].fl_x: expected a number from 0.001");
  refused(R"({"w": 1e300, "frames": [{"transform_matrix": )" + identity + "]}]}",
          "w: expected a number from 1 to 8192");
  refused(std::string(100000, '['), "expected JSON");
}
