// Tests the image layouts that load_dataset() reads in addition to Blender's.
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/dataset.h>

#include <cmath>

#include "lens.h"
#include "nerf/format_samples.h"
#include "nerf/training_images.h"
#include "support/catch.h"
#include "support/data.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
namespace fs = std::filesystem;
using Json = nlohmann::json;

TEST_CASE("dataset: one transforms.json holds out every 8th of the sorted names") {
  const TrainingImages scene;
  const Dataset train = load_dataset(scene.path), test = load_dataset(scene.path, {.split = "test"});
  CHECK(names(train) == "1 2 3 4 5 6 7 9 ");
  CHECK(names(test) == "0 8 ");
  CHECK(names(load_dataset(scene.path, {.split = "val"})) == "0 8 ");
  CHECK(train.layout == Layout::transforms);
  CHECK(train.background == Background::black);
  CHECK(load_dataset(scene.path, {.background = Background::white}).background == Background::white);
  CHECK(train.scene == SceneType::place);
  const Camera& c = test.views[1].camera;
  CHECK((c.fx == 20 && c.fy == 21 && c.cx == 6.5 && c.cy == 4.5));
  CHECK(c.position() == Vec3{8, 0, 0});
  for (Index i = 3; i < test.views[0].rgba.size(); i += 4) CHECK(test.views[0].rgba[i] == 1);
  CHECK(has_split(scene.path, "test"));
}

TEST_CASE("dataset: frames without an image are left out and told of, all missing is an error") {
  TrainingImages scene;
  fs::remove(scene.image(3));
  fs::remove(scene.image(8));
  const Dataset train = load_dataset(scene.path);
  CHECK(names(train) == "1 2 4 5 6 7 9 ");
  REQUIRE(train.notes.size() == 2);
  CHECK(train.notes[0] == "every 8th of 10 images is held out for val and test");
  CHECK_THAT(train.notes[1], Contains("1 of 8 images of train are missing and left out, the first is ") &&
                                 Contains("images/3.png"));
  CHECK(names(load_dataset(scene.path, {.split = "test"})) == "0 ");
  fs::remove(scene.image(0));
  scene.expect_error("expected images to test on, got none: all 2 are missing, the first is ", "test");
  scene.json["frames"] = Json::array({scene.json["frames"][0]});
  scene.write();
  scene.expect_error("expected images to train on, got none: there are 1 views, and every 8th is held out");
}

TEST_CASE("dataset: JPEG, names without extension, and intrinsics of a frame of its own") {
  TrainingImages scene;
  fs::remove(scene.image(1));
  write_image(scene.path / "images/1.jpg", 12, 8);
  for (auto& frame : scene.json["frames"])
    if (frame["file_path"] == "images/1.png")
      frame["file_path"] = "images/1", frame["fl_x"] = 30, frame["cy"] = 3;
  scene.write();
  const Dataset train = load_dataset(scene.path);
  CHECK(names(train) == "1 2 3 4 5 6 7 9 ");
  const Camera &own = train.views[0].camera, &common = train.views[1].camera;
  CHECK((own.fx == 30 && own.fy == 21 && own.cx == 6.5 && own.cy == 3));
  CHECK((common.fx == 20 && common.cy == 4.5));
}

TEST_CASE("dataset: distorted images are cut to what every lens covers, and keep their scale") {
  TrainingImages scene;
  scene.json["k1"] = 2;
  scene.json["frames"][4]["k1"] = 4;
  scene.write();
  const Dataset train = load_dataset(scene.path), test = load_dataset(scene.path, {.split = "test"});
  const Camera& c = train.views[0].camera;
  CHECK(c.width < 12);
  CHECK(c.height < 8);
  CHECK((c.fx == 20 && c.fy == 21));
  for (const Dataset* set : {&train, &test})
    for (const View& v : set->views) {
      CHECK(v.camera.parameters()[14] == c.cx);
      CHECK(v.rgba.shape == Shape{c.height, c.width, 4});
    }
  CHECK_THAT(train.notes.back(), Contains("images of 12 x 8 pixels behind a lens are cut to the " +
                                          std::to_string(c.width) + " x " + std::to_string(c.height)));
  const Dataset half = load_dataset(scene.path, {.size = 6});
  CHECK(half.views[0].camera.width == (c.width + 1) / 2);
  CHECK(half.views[0].camera.fx ==
        Approx(20.0 * static_cast<double>(half.views[0].camera.width) / static_cast<double>(c.width)));
  scene.json["k1"] = -30;
  scene.write();
  scene.expect_error(
      "transforms.json: frames[9].file_path: [covered_part] lens: must have an inverse everywhere "
      "in the image, got k1 -30 k2 0 p1 0 p2 0");
}

TEST_CASE("dataset: views behind a lens keep the file's colours and say where they were seen") {
  TrainingImages scene;
  for (int i = 0; i < 10; ++i) write_image(scene.image(i), 12, 8, static_cast<std::uint64_t>(i));
  scene.json["k1"] = 2;
  scene.json["frames"][4]["k1"] = 4;
  scene.write();
  const Dataset data = load_dataset(scene.path), resampled = load_dataset(scene.path, {.resampled = true});
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    const View& view = data.views[v];
    const Camera& c = view.camera;
    CAPTURE(view.name);
    CHECK(c.parameters() == resampled.views[v].camera.parameters());
    CHECK(!resampled.views[v].offsets);
    CHECK(view.valid.empty());
    REQUIRE(view.offsets);
    REQUIRE(std::ssize(*view.offsets) == c.width * c.height);
    const Tensor<float> file = read_image(scene / "images" / (view.name + ".png"));
    const Lens lens{.k1 = view.name == "5" ? 4. : 2.};
    for (Index p = 0; p < c.width * c.height; ++p) {
      const auto [right, down] = (*view.offsets)[at(p)];
      const Vec2 seen = lens.distorted({(static_cast<double>(p % c.width) + 0.5 + right - c.cx) / c.fx,
                                        (static_cast<double>(p / c.width) + 0.5 + down - c.cy) / c.fy});
      const double x = 20 * seen[0] + 6.5, y = 21 * seen[1] + 4.5;  // the centre of a pixel
      CHECK(std::abs(x - std::floor(x) - 0.5) < 1e-4);
      CHECK(std::abs(y - std::floor(y) - 0.5) < 1e-4);
      const Index pixel = static_cast<Index>(y) * 12 + static_cast<Index>(x);
      CHECK(std::equal(&file.data[at(3 * pixel)], &file.data[at(3 * pixel)] + 3, &view.rgba.data[at(4 * p)]));
    }
  }
  // Frame 5 has its own lens; the others share one.
  CHECK(data.views[0].offsets == data.views[1].offsets);
  CHECK(data.views[4].name == "5");
  CHECK(data.views[4].offsets != data.views[0].offsets);
  TrainingImages pinhole;
  CHECK(!load_dataset(pinhole.path).views[0].offsets);
}

TEST_CASE("dataset: images of another size than stated or than the first are refused") {
  TrainingImages scene;
  write_image(scene.image(2), 24, 16);
  scene.expect_error("frames[7].file_path: expected an image of 12 x 8 pixels as frames[8], got 24 x 16");
  scene.json["k1"] = 0.1;
  scene.write();
  scene.expect_error("frames[7].file_path: expected an image of 12 x 8 pixels as frames[8], got 24 x 16");
  write_image(scene.image(2), 8, 12);
  scene.json.erase("k1");
  scene.write();
  scene.expect_error(
      "frames[7].file_path: [camera] image: must be of 12 x 8 pixels as stated, or that scaled, "
      "got 8 x 12");
  write_file_atomically(scene.image(2), "no image");
  scene.expect_error("frames[7].file_path: ");
}

TEST_CASE("dataset: a folder that is no data set names what was looked for") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(
      load_dataset(folder.path),
      Contains("expected a data set: transforms_train.json (Blender), transforms.json (instant-ngp, "
               "nerfstudio), poses_bounds.npy (LLFF), or cameras.bin or cameras.txt (COLMAP)"));
  CHECK_THROWS_AS(find_layout(folder.path), IoError);
  fs::create_directories(folder.path / "scene");
  write_file_atomically(folder.path / "scene/transforms.json", "");
  CHECK_THROWS_WITH(find_layout(folder.path), Contains("got none of these files; " +
                                                       (folder.path / "scene").string() + " is a data set"));
  fs::remove_all(folder.path / "scene");
  write_file_atomically(folder.path / "poses_bounds.npy", "");
  CHECK(find_layout(folder.path) == Layout::llff);
  write_file_atomically(folder.path / "transforms.json", "");
  CHECK(find_layout(folder.path) == Layout::transforms);
  CHECK(!fs::exists(folder.path / "transforms_test.json"));
  write_file_atomically(folder.path / "transforms_test.json", "");
  CHECK(find_layout(folder.path) == Layout::blender);
  CHECK(!has_split(folder.path, "train"));
}

TEST_CASE("dataset: LLFF takes the folder of images that fits the size") {
  const TemporaryFolder folder;
  write_file_atomically(folder.path / "poses_bounds.npy", std::string_view(llff_file(llff_rows(3))));
  for (int i = 0; i < 3; ++i) {
    write_image(folder.path / "images" / ("p" + std::to_string(i) + ".png"), 80, 60);
    write_image(folder.path / "images_4" / ("p" + std::to_string(i) + ".jpg"), 20, 15);
    write_image(folder.path / "images_2" / ("p" + std::to_string(i) + ".png"), 40, 30);
  }
  const auto width = [&](Index size) {
    const Dataset set = load_dataset(folder.path, {.size = size});
    CHECK(set.views[0].camera.fx == Approx(70.0 * static_cast<double>(set.views[0].camera.width) / 80));
    return set.notes.front() + " " + std::to_string(set.views[0].camera.width);
  };
  CHECK(width(0) == "images of images 80");
  CHECK(width(80) == "images of images 80");
  CHECK(width(41) == "images of images 41");
  CHECK(width(40) == "images of images_2 40");
  CHECK(width(20) == "images of images_4 20");
  CHECK(width(16) == "images of images_4 16");
  const Dataset test = load_dataset(folder.path, {.split = "test"}), train = load_dataset(folder.path);
  CHECK(names(test) == "p0 ");
  CHECK(names(train) == "p1 p2 ");
  CHECK(train.layout == Layout::llff);
  CHECK(train.scene == SceneType::forward);
  REQUIRE(train.views[1].depth);
  CHECK(train.views[1].depth->near == Approx(4 / 1.5));
  CHECK(train.views[1].camera.position()[0] == Approx(1 / 1.5));
  fs::remove(folder.path / "images_4/p1.jpg");
  CHECK_THROWS_WITH(
      load_dataset(folder.path, {.size = 16}),
      Contains("images_4: expected an image for each of the 3 rows of ") && Contains(", got 2"));
  for (const char* images : {"images", "images_2", "images_4"}) fs::remove_all(folder.path / images);
  CHECK_THROWS_WITH(load_dataset(folder.path),
                    Contains("expected images (.png, .jpg, .jpeg) in a folder images"));
}

TEST_CASE("dataset: cameras all around are not forward-facing") {
  const TemporaryFolder folder;
  auto rows = llff_rows(3);
  // The third camera looks along -x: its down, right and backwards axes.
  const double turned[] = {0, 0, 1, 0, 60, -1, 0, 0, 0, 80, 0, -1, 0, 0, 70};
  std::copy(std::begin(turned), std::end(turned), rows.begin() + 34);
  write_file_atomically(folder.path / "poses_bounds.npy", std::string_view(llff_file(rows)));
  for (const char* name : {"a", "b", "c"})
    write_image(folder.path / "images" / (std::string(name) + ".png"), 8, 6);
  CHECK(load_dataset(folder.path).scene == SceneType::place);
}

TEST_CASE("dataset: COLMAP models in text and binary, in each of their places") {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "b.png", "sub/c.png"}) write_image(folder.path / "images" / name, 80, 60);
  const auto write = [&](const fs::path& model, bool binary) {
    fs::create_directories(model);
    const std::string end = binary ? ".bin" : ".txt";
    write_file_atomically(model / ("cameras" + end),
                          std::string_view(binary ? colmap_cameras_binary() : kColmapCamerasText));
    write_file_atomically(model / ("images" + end),
                          std::string_view(binary ? colmap_images_binary() : kColmapImagesText));
  };
  for (const bool binary : {false, true})
    for (const fs::path& model : {folder.path / "sparse" / "0", folder.path / "sparse", folder.path}) {
      write(model, binary);
      for (const fs::path& given : {folder.path, model}) {
        const Dataset train = load_dataset(given), test = load_dataset(given, {.split = "test"});
        CHECK(train.layout == Layout::colmap);
        CHECK(names(train) == "b c ");
        CHECK(names(test) == "a ");
        CHECK(train.views[0].camera.fy == 71);
        CHECK(test.views[0].camera.fy == 70);
        CHECK(train.views[0].rgba.shape == test.views[0].rgba.shape);
      }
      fs::remove_all(folder.path / "sparse");
      for (const char* stem : {"cameras", "images"})
        fs::remove(folder.path / (std::string(stem) + (binary ? ".bin" : ".txt")));
    }
}

TEST_CASE("dataset: errors of COLMAP models name file and image") {
  const TemporaryFolder folder;
  const auto expect = [&](const std::string& message) {
    CHECK_THROWS_WITH(load_dataset(folder.path), Contains(message));
    CHECK_THROWS_AS(load_dataset(folder.path), IoError);
  };
  write_file_atomically(folder.path / "cameras.txt", std::string_view("1 PINHOLE 80 60 70 71 40 30\n"));
  expect("images.txt");
  write_file_atomically(folder.path / "images.txt", std::string_view(kColmapImagesText));
  expect("images.txt: a.png: expected a camera of " + (folder.path / "cameras.txt").string() +
         ", got number 2");
  write_file_atomically(folder.path / "cameras.txt", std::string_view(kColmapCamerasText));
  expect("expected images to train on, got none: all 2 are missing, the first is ");
}

TEST_CASE("dataset: the training images of fox and fern") {
  const auto fox = data_or_skip("fox", "dataset: the training images of fox");
  const auto fern = data_or_skip("nerf_llff/fern", "dataset: the training images of fern");
  if (!fox || !fern) return;
  const Dataset train = load_dataset(*fox), test = load_dataset(*fox, {.split = "test", .size = 120});
  CHECK((train.views.size() == 58 && test.views.size() == 9));
  CHECK(train.views[0].rgba.shape == Shape{475, 266, 4});
  CHECK(test.views[0].rgba.shape == Shape{119, 67, 4});
  CHECK(test.views[1].name == "0009");
  CHECK(camera_span(train).up[2] > 0.99);
  const Dataset leaves = load_dataset(*fern, {.split = "test"});
  CHECK(leaves.views.size() == 3);
  CHECK(leaves.scene == SceneType::forward);
  CHECK(leaves.views[0].rgba.shape == Shape{378, 504, 4});
  CHECK(leaves.views[0].camera.fx == Approx(3260.5263 / 8));
  double near = 1e9;
  for (const auto& v : load_dataset(*fern).views) near = std::min(near, v.depth->near);
  for (const auto& v : leaves.views) near = std::min(near, v.depth->near);
  CHECK(near == Approx(4.0 / 3));
}
