#include <fieldmark/imaging/lpips.h>

#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/random_weights.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("eval compares with the images of the split, one row each", "[eval]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), field = tiny_field(folder, scene);
  const auto r = run_command({"eval", "--field", field, "--data", scene, "--split", "train", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const nlohmann::json json = nlohmann::json::parse(r.out);
  CHECK(json["views"] == 16);
  CHECK(json["lpips_alex"].is_null());  // 16 pixels are too few for AlexNet
  double sum = 0;
  for (const auto& view : json["per_view"]) sum += view["psnr"].get<double>();
  CHECK(json["psnr"].get<double>() == Approx(sum / static_cast<double>(json["per_view"].size())));
  for (const char* key : {"psnr_foreground", "ssim"}) CHECK(json.at(key).is_number());
  const auto finer = run_command(
      {"eval", "--field", field, "--data", scene, "--split", "train", "--supersampling", "2", "--json", "-"});
  REQUIRE(finer.code == cli::kOk);
  CHECK(nlohmann::json::parse(finer.out)["supersampling"] == 2);
  CHECK(nlohmann::json::parse(finer.out)["psnr"] != json["psnr"]);
}

TEST_CASE("eval gives LPIPS where there are weights, for each view and their mean", "[eval]") {
  const TemporaryFolder folder;
  const std::string scene = folder / "scene", weights = folder / "alex.safetensors";
  REQUIRE(run_command({"scene", "--out", scene, "--kind", "sphere", "--size", "32", "--views", "4"}).code ==
          0);
  random_weights(lpips_tensors(LpipsNetwork::alex)).write(weights);
  const auto r = run_command({"eval", "--field", tiny_field(folder, scene), "--data", scene, "--split",
                              "train", "--lpips-weights", weights, "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK_THAT(r.err, Contains("lpips"));
  const nlohmann::json json = nlohmann::json::parse(r.out);
  double sum = 0;
  for (const auto& view : json["per_view"]) sum += view["lpips_alex"].get<double>();
  CHECK(json["lpips_alex"].get<double>() == Approx(sum / static_cast<double>(json["per_view"].size())));
  CHECK(sum > 0);
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
