// Tests the splits that a file lists.
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
