#include <fieldmark/core/files.h>

#include <nlohmann/json.hpp>

#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("bench captures trains with and without corrections, from given and from jittered poses",
          "[bench]") {
  const TemporaryFolder folder;
  const auto r = run_command({"bench", "captures", "--scene", tiny_scene(folder), "--seconds", "0.2",
                              "--degrees", "1", "--part", "0.02", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["scene"] == "scene");
  CHECK(json["degrees"] == 1);
  CHECK(json["part"] == 0.02);
  REQUIRE(json["rows"].size() == 6);
  CHECK(json["rows"][0]["variant"] == "as captured");
  for (const auto& row : json["rows"]) {
    CHECK(row["steps"] > 0);
    CHECK(row["psnr"] > 5);
    CHECK(row["psnr_colour_fitted"] > 5);
    CHECK(row["psnr_pose_fitted"] > 5);
  }
  CHECK(json.contains("recovered"));
  CHECK_THAT(r.err, Contains("jittered, poses refined") && Contains("bring back"));
}
