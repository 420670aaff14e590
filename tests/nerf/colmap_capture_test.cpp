// Tests which COLMAP model of a folder is read, and where its images are.
#include "capture.h"

#include "nerf/training_images.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
namespace fs = std::filesystem;

namespace {
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

TEST_CASE(
    "colmap capture: of several COLMAP models side by side the one with the most images is taken and named") {
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

TEST_CASE("colmap capture: COLMAP models in the places where its programs leave them") {
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

TEST_CASE("colmap capture: COLMAP images under another extension than the model's") {
  const TemporaryFolder scene;
  write_images(scene / "images", 9);
  for (int i = 0; i < 9; ++i) write_image(scene / "images_2" / (std::to_string(i) + ".JPG"), 6, 4);
  write_model(scene / "sparse/0", 9);
  const Dataset half = load_dataset(scene.path, {.size = 6});
  CHECK(names(half) == "1 2 3 4 5 6 7 ");
  CHECK(half.views[0].camera.fx == 10);
}
