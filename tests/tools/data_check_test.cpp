#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;
namespace fs = std::filesystem;

TEST_CASE("data check tells what a data set holds, and draws its cameras", "[data]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder);
  const auto r =
      run_command({"data", "check", scene, "--cameras", folder / "c.png", "--json", folder / "r.json"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK_THAT(r.out, Contains("layout      blender\n") &&
                        Contains("scene type  object: 100% of the pixels at the images' borders are") &&
                        Contains("images      21 of 16 x 16 pixels\n") &&
                        Contains("splits      train 16, val 1, test 4\n") && Contains("21 around (") &&
                        Contains("horizontal field of view 39.6 degrees\n") && Contains("no warnings\n"));
  CHECK(read_image(folder / "c.png").shape == Shape{700, 1240, 3});
  const nlohmann::json json = nlohmann::json::parse(read_text(folder / "r.json"));
  for (const char* key :
       {"name", "layout", "scene_type", "scene_type_reason", "background", "sizes", "masked_images", "splits",
        "centre", "up", "distances", "spread_degrees", "field_of_view_degrees", "cameras", "warnings"})
    CHECK(json.contains(key));
  CHECK(json["warnings"].empty());
  CHECK(json["cameras"].size() == 21);
  CHECK(json["sizes"][0]["images"] == 21);
}

TEST_CASE("data check names each oddity with its remedy and ends with 0, and train tells the same in short",
          "[data]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder);
  const auto image = [&](const std::string& name) { return fs::path(scene) / (name + ".png"); };
  const auto replace = fs::copy_options::overwrite_existing;
  fs::copy_file(image("train/r_1"), image("train/r_2"), replace);
  fs::copy_file(image("train/r_3"), image("test/r_0"), replace);
  write_png(image("train/stray"), Tensor<float>({16, 16, 4}));
  const auto r = run_command({"data", "check", scene, "--json", "-"});
  REQUIRE(r.code == cli::kOk);
  CHECK_THAT(
      r.err,
      Contains("warning: 1 of 16 training images equal to another one, the first is train/r_2, as "
               "train/r_1\n         remove all but one of each") &&
          Contains("warning: 1 of 5 held-out images the same as a training image, or nearly so, the first "
                   "is test/r_0, as train/r_3\n         hold out other images") &&
          Contains("warning: 1 image without a camera"));
  const auto warnings = nlohmann::json::parse(r.out)["warnings"];
  REQUIRE(warnings.size() == 3);
  CHECK(warnings[0]["kind"] == "duplicates");
  CHECK(warnings[0]["count"] == 1);
  CHECK(warnings[0]["images"][0] == "train/r_2");
  CHECK(warnings[0]["partners"][0] == "train/r_1");
  CHECK(warnings[1]["kind"] == "twins");
  CHECK(warnings[2]["kind"] == "images_without_camera");
  const auto train =
      run_command({"train", "--data", scene, "--out", folder / "f.fm", "--steps", "1", "--json", "-"});
  REQUIRE(train.code == cli::kOk);
  CHECK_THAT(train.err,
             Contains("warning: 1 of 16 training images equal to another one, the first is train/r_2, as "
                      "train/r_1; fieldmark data check tells more\n") &&
                 Contains("warning: 1 of 4 held-out images the same as a training image"));
  const auto told = nlohmann::json::parse(train.out)["warnings"];
  REQUIRE(told.size() == 3);
  CHECK(told[0] == warnings[0]);
  CHECK(told[1]["kind"] == "images_without_camera");
  CHECK(told[2]["kind"] == "twins");
}

TEST_CASE("data check of what cannot be loaded, and its options", "[data]") {
  const TemporaryFolder folder;
  const auto none = run_command({"data", "check", folder / "none"});
  CHECK(none.code == cli::kFailed);
  CHECK(none.err == "fieldmark: " + (folder / "none").string() +
                        ": expected a data set folder, got nothing of that name\n");
  const std::string scene = tiny_scene(folder);
  CHECK(run_command({"data", "check"}).code == cli::kUsage);
  CHECK(run_command({"data", "check", scene, "--size", "15"}).code == cli::kUsage);
  const auto name = run_command({"data", "check", scene, "--cameras", folder / "c.jpg"});
  CHECK(name.code == cli::kUsage);
  CHECK_THAT(name.err, Contains("expected a name that ends in .png"));
  const auto nowhere = run_command({"data", "check", scene, "--cameras", "/no/folder/c.png"});
  CHECK(nowhere.code == cli::kFailed);
  CHECK_THAT(nowhere.err, Contains("/no/folder"));
  write_file_atomically(fs::path(scene) / "train/r_3.png", std::string_view("no image"));
  const auto broken = run_command({"data", "check", scene});
  CHECK(broken.code == cli::kFailed);
  CHECK_THAT(broken.err, Contains("transforms_train.json: frames[3].file_path: ") && Contains("r_3.png"));
  CHECK(std::ranges::count(broken.err, '\n') == 1);
}
