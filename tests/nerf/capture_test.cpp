// Tests the splits that a file lists, and the choice among COLMAP models.
#include "capture.h"

#include <algorithm>

#include "nerf/format_samples.h"
#include "nerf/training_images.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
namespace fs = std::filesystem;

namespace {
std::string split_names(const fs::path& folder, const std::string& split) {
  return names(load_dataset(folder, {.split = split}));
}

// Writes a text model of the images "0.png" to "(count - 1).png", with or without points.
void write_model(const fs::path& model, int count, const std::string& points = "\n") {
  fs::create_directories(model);
  std::string images = "# Image list\n";
  for (int i = 0; i < count; ++i)
    images += std::to_string(i + 1) + " 1 0 0 0 0 0 " + std::to_string(i) + " 1 " + std::to_string(i) +
              ".png\n" + points;
  write_file_atomically(model / "images.txt", images);
  write_file_atomically(model / "cameras.txt", std::string_view("1 PINHOLE 12 8 20 21 6 4\n"));
}

void write_images(const fs::path& folder, int count) {
  for (int i = 0; i < count; ++i) write_image(folder / (std::to_string(i) + ".png"), 12, 8);
}
}  // namespace

TEST_CASE("capture: the splits are those that the file lists") {
  TrainingImages scene;
  scene.json["train_filenames"] = {"images/1.png", "./images/2.png", "images\\5.png"};
  scene.json["val_filenames"] = {"images/3.png"};
  scene.json["test_filenames"] = {"images/0.png", "images/4.png"};
  scene.write();
  CHECK(split_names(scene.path, "train") == "1 2 5 ");
  CHECK(split_names(scene.path, "val") == "3 ");
  CHECK(split_names(scene.path, "test") == "0 4 ");
  CHECK(load_dataset(scene.path).notes ==
        std::vector<std::string>{"the file's own split: 3 images to train, 1 to val, 2 to test"});
}

TEST_CASE("capture: a list that lacks is what the others leave") {
  TrainingImages scene;
  scene.json["test_filenames"] = {"images/0.png", "images/4.png"};
  scene.json["val_filenames"] = nlohmann::json::array();
  scene.write();
  CHECK(split_names(scene.path, "train") == "1 2 3 5 6 7 8 9 ");
  CHECK(split_names(scene.path, "val") == "0 4 ");
  CHECK(split_names(scene.path, "test") == "0 4 ");
  scene.json.erase("test_filenames");
  scene.json["train_filenames"] = {"images/0.png", "images/4.png"};
  scene.write();
  CHECK(split_names(scene.path, "train") == "0 4 ");
  CHECK(split_names(scene.path, "test") == "1 2 3 5 6 7 8 9 ");
  CHECK(split_names(scene.path, "val") == "1 2 3 5 6 7 8 9 ");
  // With nothing held out, that split does not exist, which is known before training.
  for (int i = 0; i < 10; ++i) scene.json["train_filenames"].push_back(scene.frame(i)["file_path"]);
  scene.write();
  CHECK(has_split(scene.path, "train"));
  CHECK(!has_split(scene.path, "test"));
  scene.expect_error("expected images to test on, got none: the file's own split has none", "test");
}

TEST_CASE("capture: images on both sides of a split and names of no frame are told of") {
  TrainingImages scene;
  scene.json["train_filenames"] = {"images/1.png", "images/2.png", "images/gone.png"};
  scene.json["test_filenames"] = {"images/2.png"};
  scene.write();
  const Dataset train = load_dataset(scene.path);
  REQUIRE(train.notes.size() == 3);
  CHECK(train.notes[0] ==
        "1 names of train_filenames are those of no frame and left out, the first is images/gone.png");
  CHECK(train.notes[2] == "1 images are both trained on and held out, so their PSNR flatters");
  scene.json["test_filenames"] = {"2.png"};
  scene.write();
  scene.expect_error(
      "test_filenames: expected names that frames have as their file_path, got none, the first is \"2.png\"");
  scene.json["test_filenames"] = {3};
  scene.write();
  scene.expect_error("test_filenames[0]: expected text, got number");
}

TEST_CASE("capture: a split whose images all lack is none") {
  TrainingImages scene;
  CHECK(has_split(scene.path, "test"));
  for (const int held_out : {0, 8}) fs::remove(scene.image(held_out));
  CHECK(!has_split(scene.path, "test"));
  CHECK(has_split(scene.path, "train"));
  // The files that BlenderNeRF leaves: a file of test cameras and no images.
  fs::rename(scene / "transforms.json", scene / "transforms_train.json");
  scene.json["frames"] = {
      {{"file_path", "test/r_0.png"}, {"transform_matrix", scene.frame(0)["transform_matrix"]}}};
  write_file_atomically(scene / "transforms_test.json", scene.json.dump());
  CHECK(!has_split(scene.path, "test"));
  write_image(scene / "test/r_0.png", 12, 8);
  CHECK(has_split(scene.path, "test"));
}

TEST_CASE("capture: of several COLMAP models side by side the one with the most images is taken and named") {
  const TemporaryFolder scene;
  write_images(scene / "images", 10);
  write_model(scene / "sparse/0", 3);
  write_model(scene / "sparse/1", 9);
  write_model(scene / "sparse/10", 9);
  write_model(scene / "sparse/2", 4);
  const Dataset train = load_dataset(scene.path);
  CHECK(names(train) == "1 2 3 4 5 6 7 ");
  CHECK(train.notes[0] ==
        "COLMAP model sparse/1 is taken, which has the most images of 4: sparse/0 has 3, sparse/1 has 9, "
        "sparse/2 has 4, sparse/10 has 9");
  write_file_atomically(scene / "sparse/1/images.txt", std::string_view("1 nothing\n"));
  CHECK(colmap_folder(scene.path) == scene / "sparse/10");
  // A single model needs no note.
  for (const char* other : {"sparse/1", "sparse/10", "sparse/2"}) fs::remove_all(scene / other);
  CHECK(load_dataset(scene.path).notes[0] == "images of images");
}

TEST_CASE("capture: COLMAP models in the places where its programs leave them") {
  for (const char* model :
       {"colmap/sparse/0", "colmap/sparse", "colmap", "dense/sparse", "dense/0/sparse", "0"}) {
    const TemporaryFolder scene;
    write_images(scene / "input", 9);
    write_model(scene.path / model, 9);
    CHECK(find_layout(scene.path) == Layout::colmap);
    CHECK(names(load_dataset(scene.path)) == "1 2 3 4 5 6 7 ");
    if (std::string(model) != "0") CHECK(names(load_dataset(scene.path / model)) == "1 2 3 4 5 6 7 ");
  }
  // Undistorted images lie next to their model; they are read, not the images that they were made from.
  const TemporaryFolder scene;
  write_images(scene / "images", 9);
  write_images(scene / "dense/0/images", 7);
  write_model(scene / "dense/0/sparse", 9);
  CHECK(load_dataset(scene.path).notes.back() ==
        "1 of 7 images of train are missing and left out, the first is " +
            (scene / "dense/0/images/7.png").string());
}

TEST_CASE("capture: COLMAP images under another extension than the model's") {
  const TemporaryFolder scene;
  write_images(scene / "images", 9);
  for (int i = 0; i < 9; ++i) write_image(scene / "images_2" / (std::to_string(i) + ".JPG"), 6, 4);
  write_model(scene / "sparse/0", 9);
  const Dataset half = load_dataset(scene.path, {.size = 6});
  CHECK(names(half) == "1 2 3 4 5 6 7 ");
  CHECK(half.views[0].camera.fx == 10);
}

TEST_CASE("capture: images and masks named by the paths of another computer are found, with a note") {
  TrainingImages scene;
  scene.frame(1)["file_path"] = "/home/me/scene/images/1.png";
  scene.frame(2)["file_path"] = "C:\\scene\\images\\2.png";
  fs::create_directories(scene.path / "masks");
  write_png(scene.path / "masks/3.png", Tensor<float>(Shape{8, 12, 3}, 1.f));
  scene.frame(3)["mask_path"] = "/home/me/scene/masks/3.png";
  scene.write();
  const Dataset data = load_dataset(scene.path);
  CHECK(names(data) == "1 2 3 4 5 6 7 9 ");
  CHECK(std::ranges::count(data.notes,
                           "3 files are named by a path that is not there, and found by its end in " +
                               scene.path.string()) == 1);
  CHECK(load_dataset(scene.path, {.split = "test"}).views.size() == 2);
}
