#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;
using Json = nlohmann::json;

TEST_CASE("eval compares with the photographs of the split, one row each", "[eval]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), field = tiny_field(folder, scene);
  const auto r = run_command({"eval", "--field", field, "--data", scene, "--split", "train", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const Json json = Json::parse(r.out);
  CHECK(json["views"] == 4);
  CHECK(json["lpips_alex"].is_null());
  double sum = 0;
  for (const auto& view : json["per_view"]) sum += view["psnr"].get<double>();
  CHECK(json["psnr"].get<double>() == Approx(sum / 4));
  for (const char* key : {"psnr_object", "ssim"}) CHECK(json.at(key).is_number());
}

TEST_CASE("eval refuses what is no field, and splits that do not exist", "[eval]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), key = folder / "k";
  REQUIRE(run_command({"key", "--out", key}).code == cli::kOk);
  const auto kind = run_command({"eval", "--field", key, "--data", scene});
  CHECK(kind.code == cli::kFailed);
  CHECK_THAT(kind.err, Contains(key) && Contains("field") && Contains("key"));
  CHECK(run_command({"eval", "--field", folder / "none", "--data", scene}).code == cli::kFailed);
  CHECK(run_command({"eval", "--field", key, "--data", scene, "--split", "tset"}).code == cli::kUsage);
}
