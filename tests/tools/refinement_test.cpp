#include "cli/refinement.h"

#include <fieldmark/core/files.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;

namespace {
Outcome train(const std::string& scene, const std::string& out, std::vector<std::string> more) {
  std::vector<std::string> words{"train",           "--data", scene,    "--out", out,
                                 "--max-megabytes", "1",      "--json", "-"};
  words.insert(words.end(), more.begin(), more.end());
  return run_command(words);
}
}  // namespace

TEST_CASE("refinement: train --exposure on learns exposures, and off gives the bytes of a run without",
          "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder, "4");
  const auto none = train(scene, folder / "none.fm", {"--steps", "6"}),
             off = train(scene, folder / "off.fm", {"--steps", "6", "--exposure", "off"}),
             on = train(scene, folder / "on.fm", {"--steps", "6", "--exposure", "on"});
  INFO(on.err);
  REQUIRE(on.code == cli::kOk);
  CHECK(read_bytes(folder / "none.fm") == read_bytes(folder / "off.fm"));
  CHECK(read_bytes(folder / "none.fm") != read_bytes(folder / "on.fm"));
  const auto json = nlohmann::json::parse(on.out);
  CHECK(json["exposure"] == "on");
  CHECK(json["test_psnr_colour_fitted"].is_number());
  CHECK(nlohmann::json::parse(none.out)["exposure"] == "off");
  CHECK_FALSE(json.contains("camera_motion"));
  CHECK(train(scene, folder / "x.fm", {"--steps", "6", "--exposure", "maybe"}).code == cli::kUsage);
}

TEST_CASE("refinement: train --exposure auto leaves exposures off without validation images", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder, "6");
  std::filesystem::remove_all(std::filesystem::path(scene) / "val");
  std::filesystem::remove(std::filesystem::path(scene) / "transforms_val.json");
  const auto alone = train(scene, folder / "b.fm", {"--steps", "4", "--exposure", "auto"});
  INFO(alone.err);
  REQUIRE(alone.code == cli::kOk);
  CHECK_THAT(alone.err, Contains("--exposure auto: there are no validation images, so exposures stay off"));
  CHECK(nlohmann::json::parse(alone.out)["exposure"] == "off");
}

TEST_CASE("refinement: train --refine-poses writes the cameras, and without test images fits none",
          "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), out = folder / "f.fm";
  std::filesystem::remove_all(std::filesystem::path(scene) / "test");
  std::filesystem::remove(std::filesystem::path(scene) / "transforms_test.json");
  const auto r = train(scene, out, {"--steps", "6", "--refine-poses"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["camera_motion"]["degrees"].is_number());
  CHECK(json["camera_motion"]["distance"].is_number());
  CHECK_THAT(r.err, Contains("train cameras moved by 0."));
  const auto cameras = nlohmann::json::parse(read_text(cli::cameras_file(out)));
  CHECK(cameras["frames"].size() == 16);
  CHECK(cameras["frames"][0]["transform_matrix"].size() == 4);
}

TEST_CASE("refinement: what cannot be refined is refused, and no secret is replaced", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), out = folder / "f.fm";
  const auto poses = train(scene, out, {"--steps", "1", "--preset", "mlp", "--refine-poses"});
  CHECK(poses.code == cli::kUsage);
  CHECK_THAT(poses.err, Contains("--refine-poses: the mlp preset has no gradients in positions"));
  const auto automatic = train(scene, out, {"--steps", "1", "--preset", "mlp", "--exposure", "auto"});
  CHECK(automatic.code == cli::kUsage);
  CHECK_THAT(automatic.err, Contains("--exposure auto: short trainings of the mlp preset"));
  std::filesystem::create_directory(cli::cameras_file(out));
  const auto blocked = train(scene, out, {"--steps", "1", "--refine-poses"});
  CHECK(blocked.code == cli::kFailed);
  CHECK_THAT(blocked.err, Contains("f.fm.cameras.json"));
  CHECK(!std::filesystem::exists(out));
}

TEST_CASE("refinement: train --exposure auto resumes as it was decided", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder);
  nerf::RadianceFieldOptions sizes = nerf::field_options({.steps = 4});
  sizes.seed = 1;
  nerf::RadianceField field(sizes);
  auto options = nerf::train_options(nerf::FieldKind::hash);
  options.schedule.steps = 4;
  options.seed = 1;
  options.image_colours = true;
  const auto data = nerf::load_dataset(scene, {.split = "train"});
  nerf::Trainer trainer(field, data, options);
  trainer.step(0);
  trainer.save(folder / "f.fm.checkpoint");
  const auto r = run_command({"train", "--data", scene, "--out", folder / "f.fm", "--exposure", "auto",
                              "--resume", "--steps", "4", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK(nlohmann::json::parse(r.out)["exposure"] == "on");
  CHECK_FALSE(nlohmann::json::parse(r.out).contains("exposure_trial"));
}
