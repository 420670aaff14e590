#include "cli/scene_data.h"

#include <fieldmark/core/files.h>

#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("a scene of one transforms.json trains on its own split, and its notes are told once",
          "[scene_data]") {
  const TemporaryFolder folder;
  const std::filesystem::path scene = tiny_scene(folder, "4");
  nlohmann::json json = nlohmann::json::parse(read_text(scene / "transforms_train.json"));
  json["frames"].push_back(json["frames"][0]);
  json["frames"][4]["file_path"] = "train/zz_missing.png";
  write_file_atomically(scene / "transforms.json", json.dump());
  for (const char* split : {"train", "val", "test"})
    std::filesystem::remove(scene / ("transforms_" + std::string(split) + ".json"));
  const auto r = run_command(
      {"train", "--data", scene, "--out", folder / "f.fm", "--steps", "2", "--json", folder / "r.json"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const nlohmann::json result = nlohmann::json::parse(read_text(folder / "r.json"));
  REQUIRE(result.at("notes").size() == 2);
  CHECK(result["notes"][0] == "every 8th of 5 images is held out for val and test");
  CHECK_THAT(result["notes"][1].get<std::string>(),
             Contains("1 of 4 images of train are missing and left out, the first is ") &&
                 Contains("train/zz_missing.png"));
  CHECK(result.at("test_psnr").is_number());
  for (const auto& note : result["notes"]) {
    const std::string line = "note: " + note.get<std::string>() + "\n";
    const auto at = r.out.find(line);
    CHECK(at != std::string::npos);
    CHECK(r.out.find(line, at + 1) == std::string::npos);
  }
}
