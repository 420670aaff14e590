#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/dataset.h>
#include <unistd.h>
#include "transforms.h"

#include <cmath>
#include <filesystem>

#include "support/catch.h"
#include "support/data.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
namespace fs = std::filesystem;

namespace {
// A folder "toy" with two RGBA training views of 6 x 4 pixels.
struct Toy {
  fs::path root = fs::temp_directory_path() / ("fieldmark_dataset_" + std::to_string(::getpid()));
  fs::path path = root / "toy";
  fs::path json = path / "transforms_train.json";
  Tensor<float> image = quantize8(uniform<float>({4, 6, 4}, 0, 1, 3));
  Transforms transforms{.camera_angle_x = 0.8,
                        .frames = {{"./train/a", {1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3}},
                                   {"train/b.png", {1, 0, 0, 4, 0, 1, 0, 5, 0, 0, 1, 6}}}};
  Toy() {
    fs::remove_all(root);
    fs::create_directories(path / "train");
    write_png(path / "train/a.png", image);
    write_png(path / "train/b.png", image);
    write();
  }
  ~Toy() { fs::remove_all(root); }
  void write() const { write_file_atomically(json, format_transforms(transforms)); }
  void expect_error(const std::string& message) const {
    CHECK_THROWS_WITH(load_dataset(path), Contains(message));
    CHECK_THROWS_AS(load_dataset(path), IoError);
  }
};
}  // namespace

TEST_CASE("dataset: images, cameras and names as in the folder") {
  const Toy toy;
  const Dataset set = load_dataset(toy.path / "", {.background = Background::black});
  CHECK(set.name == "toy");
  CHECK(set.split == "train");
  CHECK(set.background == Background::black);
  REQUIRE(set.views.size() == 2);
  CHECK(set.views[0].rgba.data == toy.image.data);
  CHECK(set.views[0].name == "a");
  CHECK(set.views[1].name == "b");
  CHECK(set.views[1].camera.position() == Vec3{4, 5, 6});
  const Camera& c = set.views[0].camera;
  CHECK((c.width == 6 && c.height == 4 && c.cx == 3 && c.cy == 2));
  CHECK(std::abs(c.fx - 3 / std::tan(0.4)) < 1e-12);
}

TEST_CASE("dataset: images without alpha are opaque, grey ones have equal channels") {
  const Toy toy;
  const auto rgb = quantize8(uniform<float>({4, 6, 3}, 0, 1, 5)),
             grey = quantize8(uniform<float>({4, 6, 1}, 0, 1, 6));
  write_png(toy.path / "train/a.png", rgb);
  write_png(toy.path / "train/b.png", grey);
  const Dataset set = load_dataset(toy.path);
  for (Index i = 0; i < 24; ++i) {
    CHECK(set.views[0].rgba[4 * i + 3] == 1);
    for (Index k = 0; k < 3; ++k) {
      CHECK(set.views[0].rgba[4 * i + k] == rgb[3 * i + k]);
      CHECK(set.views[1].rgba[4 * i + k] == grey[i]);
    }
  }
}

TEST_CASE("dataset: resizing weighs colour by alpha and scales the camera") {
  Toy toy;
  const Dataset half = load_dataset(toy.path, {.size = 3});
  CHECK(half.views[0].rgba.shape == Shape{2, 3, 4});
  const Camera& c = half.views[0].camera;
  CHECK((c.width == 3 && c.height == 2));
  CHECK(std::abs(c.fx - 1.5 / std::tan(0.4)) < 1e-12);
  for (Index y = 0; y < 2; ++y)
    for (Index x = 0; x < 3; ++x) {
      double alpha = 0, red = 0;
      for (Index k = 0; k < 4; ++k) {
        const float* p = toy.image.data.data() + 4 * (6 * (2 * y + k / 2) + 2 * x + k % 2);
        alpha += p[3] / 4.0, red += p[0] * p[3] / 4.0;
      }
      CHECK(std::abs(half.views[0].rgba[4 * (3 * y + x) + 3] - alpha) < 1e-6);
      CHECK(std::abs(half.views[0].rgba[4 * (3 * y + x)] - red / alpha) < 1e-6);
    }
}

TEST_CASE("dataset: composited adds the background behind what is not opaque") {
  const View view{.camera = {},
                  .rgba = Tensor<float>(Shape{1, 3, 4}, {1, 0.5f, 0, 1, 1, 0.5f, 0, 0.25f, 1, 1, 1, 0}),
                  .name = ""};
  CHECK(composited(view, Background::white).data ==
        std::vector<float>{1, 0.5f, 0, 1, 0.875f, 0.75f, 1, 1, 1});
  CHECK(composited(view, Background::black).data ==
        std::vector<float>{1, 0.5f, 0, 0.25f, 0.125f, 0, 0, 0, 0});
  CHECK(background_value(Background::white) == 1);
}

TEST_CASE("dataset: errors of options and folders") {
  const Toy toy;
  CHECK_THROWS_WITH(load_dataset(toy.path, {.split = "all"}),
                    Contains("split must be train, val or test, got \"all\""));
  CHECK_THROWS_WITH(load_dataset(toy.path, {.size = -1}), Contains("size must be 0 to 65536 pixels, got -1"));
  CHECK_THROWS_WITH(load_dataset(toy.root / "none"),
                    (toy.root / "none").string() + ": expected a data set folder, got nothing of that name");
  CHECK_THROWS_WITH(load_dataset(toy.json), Contains("expected a data set folder, got something else"));
  CHECK_THROWS_WITH(load_dataset(toy.path, {.split = "val"}), Contains("transforms_val.json"));
  CHECK_THROWS_AS(load_dataset(toy.path, {.split = "val"}), IoError);
  write_file_atomically(toy.json, "{\n?");
  toy.expect_error("transforms_train.json: line 2, byte 2: expected JSON, got '?'");
}

TEST_CASE("dataset: errors of images name JSON, place and image") {
  Toy toy;
  const std::string place = toy.json.string() + ": frames[1].file_path: ",
                    b = (toy.path / "train/b.png").string();
  write_png(b, quantize8(uniform<float>({4, 5, 3}, 0, 1, 5)));
  toy.expect_error(place + "expected an image of 6 x 4 pixels as frames[0], got 5 x 4");
  // Different sizes are refused even if the resized images agree.
  write_png(b, quantize8(uniform<float>({8, 12, 3}, 0, 1, 5)));
  CHECK_THROWS_WITH(load_dataset(toy.path, {.size = 3}), Contains("got 12 x 8"));
  write_file_atomically(b, "not an image");
  toy.expect_error(place);
  toy.expect_error(b + ": ");
  auto bytes = read_bytes(toy.path / "train/a.png");
  bytes.resize(bytes.size() / 2);
  write_file_atomically(b, bytes);
  toy.expect_error(place);
  toy.expect_error(b + ": ");
  fs::remove(b);
  toy.expect_error(place + "expected an image, got no file " + b + ".png");
  fs::create_directory(b);
  toy.expect_error(place + "expected an image, got no file");
  toy.transforms.frames.clear();
  toy.write();
  toy.expect_error("transforms_train.json: frames: expected at least one view, got none");
}

TEST_CASE("dataset: the Blender lego scene") {
  const auto lego = data_or_skip("nerf_synthetic/lego", "dataset: the Blender lego scene");
  if (!lego) return;
  const Dataset set = load_dataset(*lego, {.split = "test", .size = 40});
  CHECK(set.name == "lego");
  REQUIRE(set.views.size() == 25);
  const CameraSpan span = camera_span(set);
  for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(span.centre[k]) < 1e-4);
  CHECK(span.up[2] > 0.9999999);
  for (const double d : span.distances) CHECK(std::abs(d - 4.0311) < 1e-3);
  for (const View& v : set.views) {
    CHECK(v.rgba.shape == Shape{40, 40, 4});
    CHECK(v.rgba[3] == 0);                          // a corner is empty
    CHECK(v.rgba[4 * (20 * 40 + 20) + 3] > 0.99f);  // the centre is not
  }
}
