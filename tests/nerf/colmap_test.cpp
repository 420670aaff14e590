#include "colmap.h"
#include <fieldmark/core/error.h>

#include <cmath>

#include "nerf/format_samples.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
constexpr auto kText = ColmapFormat::text, kBinary = ColmapFormat::binary;

void check_cameras(const std::map<std::uint32_t, Intrinsics>& cameras) {
  REQUIRE(cameras.size() == 2);
  const Intrinsics &a = cameras.at(1), &b = cameras.at(2);
  CHECK((a.width == 80 && a.height == 60 && a.fl_x == 70 && a.fl_y == 71 && *a.cx == 40 && *a.cy == 30));
  CHECK(a.lens == Lens{.k1 = 0.01, .k2 = -0.002, .p1 = 0.0003, .p2 = 0.0004});
  CHECK((b.fl_x == 70 && b.fl_y == 70 && *b.cx == 40 && *b.cy == 30));
  CHECK(b.lens == Lens{.k1 = 0.05});
}

void check_images(const std::vector<ColmapImage>& images) {
  REQUIRE(images.size() == 3);
  CHECK(images[0].name == "b.png");
  CHECK(images[2].name == "sub/c.png");
  CHECK(images[1].camera == 2);
  // The camera looks along z with y down; OpenGL's y and z axes point the other way.
  CHECK(images[0].pose == Pose{1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0});
  CHECK(images[2].pose[11] == 1);
  // R is 90 degrees about y: x_c = z + 1, y_c = y + 2, z_c = -x + 3; the camera is where all three are 0.
  const Pose want{0, 0, 1, 3, 0, -1, 0, -2, 1, 0, 0, -1};
  for (std::size_t k = 0; k < 12; ++k) CHECK(std::abs(images[1].pose[k] - want[k]) < 1e-15);
}

void expect_camera_error(const std::string& bytes, ColmapFormat format, const std::string& message) {
  CHECK_THROWS_WITH(parse_colmap_cameras(bytes, format, "c"), Contains("c: " + message));
  CHECK_THROWS_AS(parse_colmap_cameras(bytes, format, "c"), IoError);
}
void expect_image_error(const std::string& bytes, ColmapFormat format, const std::string& message) {
  CHECK_THROWS_WITH(parse_colmap_images(bytes, format, "i"), Contains("i: " + message));
  CHECK_THROWS_AS(parse_colmap_images(bytes, format, "i"), IoError);
}
}  // namespace

TEST_CASE("colmap: text and binary hold the same model") {
  check_cameras(parse_colmap_cameras(kColmapCamerasText, kText, "c"));
  check_cameras(parse_colmap_cameras(colmap_cameras_binary(), kBinary, "c"));
  check_images(parse_colmap_images(kColmapImagesText, kText, "i"));
  check_images(parse_colmap_images(colmap_images_binary(), kBinary, "i"));
}

TEST_CASE("colmap: each model's parameters go where they belong") {
  const auto one = [](const std::string& line) { return parse_colmap_cameras(line, kText, "c").at(1); };
  const Intrinsics a = one("1 SIMPLE_PINHOLE 8 6 7 4 3"), b = one("1 PINHOLE 8 6 7 9 4 3\r\n"),
                   c = one("1 RADIAL 8 6 7 4 3 0.1 0.2");
  CHECK((a.fl_x == 7 && a.fl_y == 7 && *a.cx == 4 && *a.cy == 3 && a.lens.is_pinhole()));
  CHECK((b.fl_x == 7 && b.fl_y == 9 && *b.cx == 4 && *b.cy == 3 && b.lens.is_pinhole()));
  CHECK(c.lens == Lens{.k1 = 0.1, .k2 = 0.2});
  CHECK(one("1 FULL_OPENCV 8 6 7 9 4 3 1 2 3 4 5 6 7 8").lens == Lens{.k1 = 1,
                                                                      .k2 = 2,
                                                                      .p1 = 3,
                                                                      .p2 = 4,
                                                                      .k3 = 5,
                                                                      .k4 = 6,
                                                                      .k5 = 7,
                                                                      .k6 = 8,
                                                                      .model = LensModel::rational});
  const Intrinsics f = one("1 opencv_fisheye 8 6 7 9 4 3 1 2 3 4");
  CHECK((f.fl_y == 9 && *f.cy == 3));
  CHECK(f.lens == Lens{.k1 = 1, .k2 = 2, .k3 = 3, .k4 = 4, .model = LensModel::fisheye});
  CHECK(one("1 Simple_Radial_Fisheye 8 6 7 4 3 1").lens == Lens{.k1 = 1, .model = LensModel::fisheye});
  CHECK(one("1 RADIAL_FISHEYE 8 6 7 4 3 1 2").lens == Lens{.k1 = 1, .k2 = 2, .model = LensModel::fisheye});
  CHECK(one("1 FULL_OPENCV 8 6 7 9 4 3 0 0 0 0 0 0 0 0").lens.is_pinhole());
}

TEST_CASE("colmap: images without their lines of points, or with some") {
  const std::string a = "1 1 0 0 0 0 0 0 1 a.png\n", b = "2 1 0 0 0 0 0 0 1 my b.png\n",
                    c = "3 1 0 0 0 0 0 0 1 7\n", points = "1 2 3 4.5 5 -1\n";
  for (const std::string& model :
       {a + b + c, a + points + b + c, a + b + points + c + points, a + "\n" + b + "\n" + c + "\n",
        a + "\n\n" + b + c, a + points + b + "\n# c\n" + c}) {
    const auto images = parse_colmap_images(model, kText, "i");
    REQUIRE(images.size() == 3);
    CHECK((images[0].name == "a.png" && images[1].name == "my b.png" && images[2].name == "7"));
  }
}

TEST_CASE("colmap: errors of text name the line") {
  expect_camera_error("", kText, "expected at least one camera, got none");
  expect_camera_error("# only\n\n", kText, "expected at least one camera, got none");
  expect_camera_error(
      "\n1 FOV 8 6 7 7 4 3 0.5", kText,
      "line 2: expected a camera model of SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, "
      "OPENCV_FISHEYE, FULL_OPENCV, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE, got 'FOV'; undistort the images");
  expect_camera_error("1 PINHOLE 8 6 7 7 4", kText,
                      "line 1: expected a principal point, got the end of the line");
  expect_camera_error("1 PINHOLE 8 6 7 7 4 3 9", kText, "line 1: expected 4 parameters of PINHOLE, got more");
  expect_camera_error("1 PINHOLE 0 6 7 7 4 3", kText, "line 1: expected a width of 1 to 65536 pixels, got 0");
  expect_camera_error("1 PINHOLE 8 -6 7 7 4 3", kText, "line 1: expected a height, got '-6'");
  expect_camera_error("1 PINHOLE 8 6 0 7 4 3", kText, "line 1: expected a focal length in (0.001, 1e9)");
  expect_camera_error("1 PINHOLE 8 6 nan 7 4 3", kText,
                      "line 1: expected a focal length in (-1e9, 1e9), got ");
  expect_camera_error("1 PINHOLE 8 6 7 7 4 3\n1 PINHOLE 8 6 7 7 4 3", kText,
                      "line 2: expected each camera once, got 1 again");
  expect_image_error("1 1 0 0 0 0 0 nan 1 b.png", kText,
                     "line 1: expected a translation in (-1e9, 1e9), got ");
  expect_image_error("1 1 1 0 0 0 0 0 1 b.png", kText,
                     "line 1: expected a rotation, a quaternion of length 1, got one of length 1.41");
  expect_image_error("1 1 0 0 0 0 0 0 1", kText,
                     "line 1: expected the name of an image, got the end of the line");
}

TEST_CASE("colmap: errors of bytes name the byte, and a count never allocates what is not there") {
  const std::string cameras = colmap_cameras_binary(), images = colmap_images_binary();
  for (std::size_t n = 0; n < cameras.size(); ++n)
    CHECK_THROWS_AS(parse_colmap_cameras(cameras.substr(0, n), kBinary, "c"), IoError);
  for (std::size_t n = 0; n < images.size(); ++n)
    CHECK_THROWS_AS(parse_colmap_images(images.substr(0, n), kBinary, "i"), IoError);
  expect_camera_error(
      cameras + "x", kBinary,
      "byte " + std::to_string(cameras.size()) + ": expected the end of the file, got 1 bytes more");
  const std::string many(8, '\xFF');
  expect_camera_error(
      many + cameras.substr(8), kBinary,
      "byte 8: expected a count of cameras of at most 3 in the bytes left, got 18446744073709551615");
  expect_image_error(many + images.substr(8), kBinary, "byte 8: expected a count of images of at most ");
  std::string places = images;
  const std::size_t at = 8 + 4 + 56 + 4 + 6;
  places.replace(at, 8, many);
  expect_image_error(places, kBinary, "byte " + std::to_string(at + 8) + ": expected a count of places");
  std::string model = cameras;
  model[12] = 7;
  expect_camera_error(model, kBinary,
                      "byte 16: expected a camera model of SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, "
                      "RADIAL, OPENCV, OPENCV_FISHEYE, FULL_OPENCV, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE, "
                      "got FOV");
  model[12] = 77;
  expect_camera_error(model, kBinary, "byte 16: expected a camera model");
  expect_image_error(
      packed(std::uint64_t{1}) + colmap_image_binary(1, {1, 0, 0, 0, 0, 0, 0}, 1, "", {}) + "   ", kBinary,
      "byte 73: expected the name of an image");
}
