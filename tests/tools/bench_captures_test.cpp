#include <fieldmark/core/files.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("bench captures trains with and without corrections, from given and from jittered poses",
          "[bench]") {
  const TemporaryFolder folder;
  const auto r = run_command({"bench", "captures", "--scene", tiny_scene(folder), "--seconds", "0.1",
                              "--degrees", "1", "--move", "0.02", "--quick", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["scene"] == "scene");
  CHECK(json["degrees"] == 1);
  CHECK(json["move"] == 0.02);
  REQUIRE(json["rows"].size() == 6);
  CHECK(json["rows"][0]["variant"] == "as captured");
  for (const auto& row : json["rows"]) {
    CHECK(row["steps"] > 0);
    CHECK(row["psnr"] > 5);
    CHECK(row["psnr_colour_fitted"] > 5);
    CHECK(row["psnr_pose_fitted"] > 5);
  }
  const auto psnr = [&](std::size_t row) { return json["rows"][row]["psnr"].get<double>(); };
  const double lost = psnr(0) - psnr(4);
  CHECK(json["as_they_are"]["lost"].get<double>() == lost);
  if (lost > 0)
    CHECK(std::abs(json["as_they_are"]["recovered"].get<double>() - (psnr(5) - psnr(4)) / lost) < 1e-12);
  else
    CHECK(json["as_they_are"]["recovered"].is_null());
  CHECK_THAT(r.err, Contains("jittered, poses refined") &&
                        Contains("poses of the test images fitted: jitter loses"));
}
