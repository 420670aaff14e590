#include <fieldmark/core/files.h>

#include <nlohmann/json.hpp>

#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("bench collapse counts what was noticed of faults, and false alarms", "[bench]") {
  const TemporaryFolder folder;
  const auto r =
      run_command({"bench", "collapse", "--scene", tiny_scene(folder), "--seconds", "0.3", "--healthy", "0.2",
                   "--patience", "10", "--ordinary", "2", "--quick", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  const auto& provoked = json["provoked"];
  CHECK(provoked["cases"] == 2);
  CHECK(provoked["noticed"].get<int>() + provoked["recovered"].get<int>() + provoked["missed"].get<int>() ==
        2);
  REQUIRE(provoked["rows"].size() == 2);
  CHECK(provoked["rows"][1]["what"] == "no occupied cell");
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
