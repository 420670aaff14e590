#include <fieldmark/core/files.h>

#include <nlohmann/json.hpp>

#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("bench training compares the default with what it could be, on the val split", "[bench]") {
  const TemporaryFolder folder;
  const auto r = run_command({"bench", "training", "--scene", tiny_scene(folder), "--seconds", "0.3",
                              "--quick", "--json", "-", "--report", folder / "training.md"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["split"] == "val");
  CHECK(json["scene"] == "scene");
  REQUIRE(json["rows"].size() == 3);
  CHECK(json["rows"][0]["choice"] == "default");
  CHECK(json["rows"][0]["difference"] == 0);
  for (const auto& row : json["rows"]) {
    CHECK(row["steps"] > 0);
    CHECK(row["samples"] > 0);
    CHECK(row["psnr"] > 5);
  }
  CHECK_THAT(r.err, Contains("24576 samples from the first step on"));
  CHECK_THAT(read_text(folder / "training.md"), Contains("## rows") && Contains("24576 samples"));
}

TEST_CASE("bench training: what is not there", "[bench]") {
  const auto r = run_command({"bench", "training", "--scene", "/nowhere"});
  CHECK(r.code != cli::kOk);
  CHECK_THAT(r.err, Contains("/nowhere"));
}
