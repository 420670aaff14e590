#include <nlohmann/json.hpp>

#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("bench data compares forms of a scene with the plain one", "[bench]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder);
  const auto r = run_command({"bench", "data", "--object", scene, "--place", scene, "--size", "16",
                              "--seconds", "0.1", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  REQUIRE(json["rows"].size() == 12);
  CHECK(json["compared"] == 9);
  CHECK(json["rows"][0]["form"] == "with alpha");
  CHECK(json["rows"][0]["loss"].is_null());
  CHECK(json["rows"][1]["most_loss"] == 1);
  int met = 0;
  for (const auto& row : json["rows"]) {
    CHECK(row["steps"] > 0);
    met += row["loss"].is_number() && row["loss"] <= row["most_loss"];
  }
  CHECK(json["met"] == met);
  CHECK_THAT(r.err, Contains("opaque before white") && Contains("dB of at most 0.1"));
}

TEST_CASE("bench data: what is not there is named", "[bench]") {
  const auto r = run_command({"bench", "data", "--object", "/nowhere"});
  CHECK(r.code != cli::kOk);
  CHECK_THAT(r.err, Contains("/nowhere"));
}
