#include "data_files.h"

#include <fieldmark/core/error.h>
#include <fieldmark/nerf/analytic_scene.h>

#include "nerf/training_images.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
namespace fs = std::filesystem;

namespace {
std::string stems(const std::vector<fs::path>& files) {
  std::string all;
  for (const fs::path& f : files) all += f.stem().string() + " ";
  return all;
}
}  // namespace

TEST_CASE("data_files: each split's images, those that miss, and those that no camera has") {
  TrainingImages scene;
  DataFiles files = list_files(scene.path, 0);
  REQUIRE(files.splits.size() == 3);
  CHECK(files.splits[0].split == "train");
  CHECK(stems(files.splits[0].files) == "1 2 3 4 5 6 7 9 ");
  CHECK(files.splits[1].files == files.splits[2].files);
  CHECK(stems(files.splits[2].files) == "0 8 ");
  CHECK(files.unused.empty());
  fs::remove(scene.image(8));
  write_image(scene.path / "images/b.png", 12, 8);
  write_image(scene.path / "images/a.jpg", 12, 8);
  // Masks, hidden files, and files that belong to an image.
  for (const char* name : {"dynamic_mask_1.png", ".2.png", "3_depth.png", "4.mask.png", "m5.png"})
    write_image(scene.path / "images" / name, 12, 8);
  scene.frame(5)["mask_path"] = "images/m5.png";
  scene.write();
  files = list_files(scene.path, 0);
  CHECK(stems(files.unused) == "a b ");
  REQUIRE(files.splits[2].missing.size() == 1);
  CHECK_THAT(files.splits[2].missing[0], Contains("images/8.png"));
  CHECK(files.splits[0].missing.empty());
}

TEST_CASE("data_files: an image of one file of the Blender layout is used, whichever split has it") {
  const TemporaryFolder folder;
  write_scene({.kind = SceneKind::sphere, .size = 4, .views = 10}, folder.path);
  const DataFiles files = list_files(folder.path, 0);
  REQUIRE(files.splits.size() == 3);
  CHECK((files.splits[0].files.size() == 10 && files.splits[2].files.size() == 2));
  CHECK(files.unused.empty());
  fs::remove(folder.path / "transforms_test.json");
  CHECK(list_files(folder.path, 0).splits.size() == 2);
  CHECK(list_files(folder.path, 0).unused.empty());  // no camera names the folder test
  write_file_atomically(folder.path / "transforms_val.json", std::string_view("{"));
  CHECK_THROWS_WITH(list_files(folder.path, 0), Contains("transforms_val.json: line 1"));
}
