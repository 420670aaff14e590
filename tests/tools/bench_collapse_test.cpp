#include <fieldmark/core/files.h>

#include <nlohmann/json.hpp>

#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("bench collapse counts what was noticed of faults, and false alarms", "[bench]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder);
  const auto r = run_command({"bench", "collapse", "--scene", scene, "--scene", scene, "--seconds", "0.1",
                              "--fault-after", "0.05", "--patience", "0.1", "--ordinary", "3", "--quick",
                              "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  REQUIRE(json["faults"].size() == 2);
  CHECK(json["faults"][0]["what"] == "no occupied cell");
  int noticed = 0, missed = 0;
  for (const auto& row : json["faults"]) {
    const bool alarm = row["said"] != "";
    noticed += alarm && row["noticed_after"] >= 0;
    missed += !alarm && !(row["explained"].is_number() && row["explained"] > 0);
  }
  CHECK(json["provoked"]["cases"] == 2);
  CHECK(json["provoked"]["noticed"] == noticed);
  CHECK(json["provoked"]["missed"] == missed);
  REQUIRE(json["runs"].size() == 2);
  CHECK(json["ordinary"]["runs"] == 2);
  CHECK(json["ordinary"]["false_alarms"] == 0);
  CHECK(json["ordinary"]["least_explained"] > 0);
  CHECK_THAT(r.err, Contains("no occupied cell") && Contains("default"));
}

TEST_CASE("bench collapse: a scene that is not there is named", "[bench]") {
  const auto r = run_command({"bench", "collapse", "--scene", "/nowhere"});
  CHECK(r.code != cli::kOk);
  CHECK_THAT(r.err, Contains("/nowhere"));
}
