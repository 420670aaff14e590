#include "view_files.h"
#include <fieldmark/core/error.h>

#include <algorithm>
#include <cmath>

#include "imaging/jpeg_bytes.h"
#include "nerf/training_images.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
namespace fs = std::filesystem;

namespace {
// Writes a mask of 12 x 8 pixels: `value` in the columns from `first` on, else 1 - value.
void write_mask(const fs::path& path, Index first, float value, Index width = 12, Index height = 8) {
  fs::create_directories(path.parent_path());
  Tensor<float> mask(Shape{height, width, 1});
  for (Index i = 0; i < mask.size(); ++i) mask[i] = i % width >= first ? value : 1 - value;
  write_png(path, mask);
}

std::vector<std::uint8_t> columns_below(Index first, Index width = 12, Index height = 8) {
  std::vector<std::uint8_t> valid;
  for (Index i = 0; i < width * height; ++i) valid.push_back(i % width < first);
  return valid;
}

const View& view_of(const Dataset& data, const std::string& name) {
  return *std::find_if(data.views.begin(), data.views.end(), [&](const View& v) { return v.name == name; });
}
}  // namespace

TEST_CASE("view files: black excludes in a mask of mask_path, all but black in a dynamic mask") {
  TrainingImages scene;
  write_mask(scene / "masks/1.png", 7, 0);
  scene.frame(1)["mask_path"] = "masks\\1.png";
  write_mask(scene / "images/dynamic_mask_2.png", 9, 1);
  // Masks of 0 and 1 instead of 0 and 255.
  write_mask(scene / "masks/3.png", 5, 0);
  Tensor<float> faint = read_image(scene / "masks/3.png");
  for (float& x : faint.data) x /= 255;
  write_png(scene / "masks/3.png", faint);
  scene.frame(3)["mask_path"] = "masks/3.png";
  scene.write();
  const Dataset data = load_dataset(scene.path);
  CHECK(view_of(data, "1").valid == columns_below(7));
  CHECK(view_of(data, "2").valid == columns_below(9));
  CHECK(view_of(data, "3").valid == columns_below(5));
  CHECK(view_of(data, "4").valid.empty());
  // 5 + 3 + 7 of 12 columns of three images of eight.
  CHECK(data.notes.back() ==
        "masks of 3 of 8 images exclude 15.6% of the pixels, which are neither learnt nor counted");
}

TEST_CASE("view files: a pixel that is part masked is excluded, at any size and behind a lens") {
  TrainingImages scene;
  write_mask(scene / "masks/1.png", 7, 0, 24, 16);  // twice the image's size: 3.5 columns
  scene.frame(1)["mask_path"] = "masks/1.png";
  scene.write();
  CHECK(view_of(load_dataset(scene.path), "1").valid == columns_below(3));
  CHECK(view_of(load_dataset(scene.path, {.size = 6}), "1").valid == columns_below(1, 6, 4));
  scene.json["k1"] = 2;
  scene.write();
  for (const bool resampled : {false, true})
    for (const Index size : {12, 6}) {
      CAPTURE(resampled, size);
      const Dataset data = load_dataset(scene.path, {.size = size, .resampled = resampled});
      const View& v = view_of(data, "1");
      REQUIRE(std::ssize(v.valid) == v.camera.width * v.camera.height);
      const auto kept = std::ranges::count(v.valid, 1);
      CHECK(kept > 0);
      CHECK(kept < std::ssize(v.valid));
      // The mask's columns are those of the distorted image: valid pixels see points left of column 3.5.
      const double scale = static_cast<double>(size) / 12;
      for (Index i = 0; i < std::ssize(v.valid); ++i) {
        const auto at_pixel = v.offsets ? (*v.offsets)[at(i)] : std::array{0.f, 0.f};
        const double x =
            (static_cast<double>(i % v.camera.width) + 0.5 + at_pixel[0] - v.camera.cx) / v.camera.fx;
        const double y =
            (static_cast<double>(i / v.camera.width) + 0.5 + at_pixel[1] - v.camera.cy) / v.camera.fy;
        const double seen = (Lens{.k1 = 2}.distorted({x, y})[0] * 20 + 6.5) * scale;  // pixels
        if (v.valid[at(i)]) CHECK(seen < 3.5 * scale);
        if (seen < 3.5 * scale - 1) CHECK(v.valid[at(i)] == 1);
      }
    }
}

TEST_CASE("view files: views behind lenses are filled up with their offsets") {
  TrainingImages scene;
  write_image(scene.image(1), 8, 12, 7);
  scene.frame(1)["w"] = 8, scene.frame(1)["h"] = 12;
  scene.json["k1"] = 0.1;
  scene.write();
  const Dataset data = load_dataset(scene.path);
  const View& v = view_of(data, "1");
  REQUIRE(v.offsets);
  REQUIRE(std::ssize(*v.offsets) == v.camera.width * v.camera.height);
  CHECK(v.own_width < v.camera.width);
  const Camera own = cropped(v.camera, {.left = 0, .top = 0, .width = v.own_width, .height = v.own_height});
  double off = 0;
  for (Index y = 0; y < own.height; ++y)
    for (Index x = 0; x < own.width; ++x) {
      const auto [right, down] = (*v.offsets)[at(y * v.camera.width + x)];
      const Vec2 seen = Lens{.k1 = 0.1}.distorted({(static_cast<double>(x) + 0.5 + right - own.cx) / own.fx,
                                                   (static_cast<double>(y) + 0.5 + down - own.cy) / own.fy});
      const double column = own.fx * seen[0] + 6.5 - 0.5;  // of the file
      const double row = own.fy * seen[1] + 4.5 - 0.5;
      raise_to(off, std::abs(column - std::round(column)));
      raise_to(off, std::abs(row - std::round(row)));
    }
  CHECK(off < 1e-4);
}

TEST_CASE("view files: errors of masks name the frame, the file and the remedy") {
  TrainingImages scene;
  scene.frame(1)["mask_path"] = "masks/1.png";
  scene.write();
  scene.expect_error("frames[8].file_path: expected the mask of its mask_path, got no file " +
                     (scene / "masks/1.png").string());
  write_mask(scene / "masks/1.png", 7, 0, 8, 12);
  scene.expect_error(
      "frames[8].file_path: expected a mask of the proportions of its image, 12 x 8 pixels, got 8 x 12 in ");
  for (int i = 0; i < 10; ++i) {
    write_mask(scene / "masks" / (std::to_string(i) + ".png"), 0, 0);
    scene.frame(i)["mask_path"] = "masks/" + std::to_string(i) + ".png";
  }
  scene.write();
  scene.expect_error("expected masks that leave pixels, got masks that exclude every pixel: black excludes");
}

TEST_CASE("view files: images of sizes that are stated are filled up to one, the filling is not valid") {
  TrainingImages scene;
  write_image(scene.image(1), 8, 12, 7);
  auto& own = scene.frame(1);
  own["w"] = 8, own["h"] = 12, own["cx"] = 4, own["cy"] = 6.5;
  write_image(scene.image(2), 10, 6);
  scene.frame(2)["w"] = 10, scene.frame(2)["h"] = 6;
  scene.write();
  const Dataset data = load_dataset(scene.path);
  CHECK(
      data.notes.back() ==
      "images of 3 sizes, from 8 x 12 pixels on, are filled up to 12 x 12; the filling is neither learnt nor "
      "counted");
  const Tensor<float> image = read_image(scene.image(1));
  const View& v = view_of(data, "1");
  CHECK((v.camera.cx == 4 && v.camera.cy == 6.5 && v.camera.fx == 20));
  for (const View& each : data.views) {
    CHECK((each.camera.width == 12 && each.camera.height == 12));
    CHECK(each.rgba.shape == Shape{12, 12, 4});
  }
  CHECK(v.valid == columns_below(8, 12, 12));
  for (Index y = 0; y < 12; ++y)
    for (Index x = 0; x < 12; ++x)
      for (Index k = 0; k < 3; ++k)
        CHECK(v.rgba[4 * (12 * y + x) + k] == (x < 8 ? image[3 * (8 * y + x) + k] : 0));
  for (Index i = 3; i < v.rgba.size(); i += 4) CHECK(v.rgba[i] == 1);
}

TEST_CASE("view files: lenses of images of several sizes are removed size by size") {
  TrainingImages scene;
  scene.json["k1"] = 2;
  write_image(scene.image(1), 8, 12);
  auto& own = scene.frame(1);
  own["w"] = 8, own["h"] = 12, own["cx"] = 4, own["cy"] = 6;
  scene.write();
  const Dataset data = load_dataset(scene.path);
  const Crop wide = covered_part({.fx = 20, .fy = 21, .cx = 6.5, .cy = 4.5, .width = 12, .height = 8},
                                 {.k1 = 2}),
             tall = covered_part({.fx = 20, .fy = 21, .cx = 4, .cy = 6, .width = 8, .height = 12}, {.k1 = 2});
  CHECK(view_of(data, "1").camera.cy == 6 - static_cast<double>(tall.top));
  CHECK(view_of(data, "2").camera.cx == 6.5 - static_cast<double>(wide.left));
  CHECK(view_of(data, "2").camera.height == tall.height);
  CHECK(std::ranges::count(view_of(data, "1").valid, 1) == tall.width * tall.height);
  CHECK(std::ranges::count(view_of(data, "2").valid, 1) == wide.width * wide.height);
}

namespace {
// Writes a JPEG file of 12 x 8 pixels, darkest in the upper left corner and brightest in the lower right,
// with an EXIF orientation.
void write_turned(const fs::path& path, int orientation) {
  Tensor<float> image(Shape{8, 12, 3});
  for (Index i = 0; i < image.size(); ++i)
    image[i] = (static_cast<float>(i / 3 % 12) / 12 + 2 * static_cast<float>(i / 36) / 8) / 3;
  write_file_atomically(path, with_orientation(encode_jpeg(image, 90), orientation, true));
}

// Returns red in the corners: upper left, upper right, lower left, lower right.
std::vector<float> corners(const View& v) {
  const Index w = v.camera.width, h = v.camera.height;
  std::vector<float> red;
  for (const Index p : {Index{0}, w - 1, (h - 1) * w, h * w - 1}) red.push_back(v.rgba[4 * p]);
  return red;
}

void check_corners(const std::vector<float>& a, const std::vector<float>& b) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) CHECK(std::abs(a[i] - b[i]) < 0.06f);
}
}  // namespace

TEST_CASE("view files: an image that asks to be turned is turned where the stated size says so") {
  TrainingImages scene;
  for (int i = 0; i < 10; ++i) scene.frame(i)["file_path"] = "images/" + std::to_string(i) + ".jpg";
  const float a = 0, b = 0.31f, c = 0.58f, d = 0.89f;  // the corners as stored
  const std::pair<int, std::vector<float>> shown[] = {
      {5, {a, c, b, d}}, {6, {c, a, d, b}}, {7, {d, b, c, a}}, {8, {b, d, a, c}}};
  for (const auto& [orientation, expected] : shown) {
    for (int i = 0; i < 10; ++i) write_turned(scene / "images" / (std::to_string(i) + ".jpg"), orientation);
    scene.json["w"] = 12, scene.json["h"] = 8;
    scene.write();
    check_corners(corners(load_dataset(scene.path).views[0]), {a, b, c, d});
    scene.json["w"] = 8, scene.json["h"] = 12;
    scene.write();
    const Dataset turned = load_dataset(scene.path);
    CHECK((turned.views[0].camera.width == 8 && turned.views[0].camera.height == 12));
    check_corners(corners(turned.views[0]), expected);
  }
}

TEST_CASE(
    "view files: where the stated size does not say how an image is turned, it is refused with both "
    "remedies") {
  TrainingImages scene;
  write_turned(scene / "images/1.jpg", 3);
  scene.frame(1)["file_path"] = "images/1.jpg";
  scene.write();
  scene.expect_error("frames[8].file_path: the image asks to be turned for display (EXIF orientation 3)");
  scene.expect_error("exiftool -Orientation= FILE");
  write_turned(scene / "images/1.jpg", 1);
  check_corners(corners(view_of(load_dataset(scene.path), "1")), {0, 0.31f, 0.58f, 0.89f});
}
