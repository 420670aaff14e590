#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("data list names the data sets", "[data]") {
  const auto r = run_command({"data", "list", "--json", "-"});
  CHECK(r.code == cli::kOk);
  CHECK_THAT(r.err, Contains("nerf_synthetic_lego") && Contains("licence: CC-BY-NC"));
  const nlohmann::json json = nlohmann::json::parse(r.out);
  REQUIRE(json["data_sets"].size() >= 6);
  for (const auto& set : json["data_sets"])
    for (const char* key : {"name", "kind", "title", "files", "bytes", "licence", "source", "url"})
      CHECK(set.contains(key));
}

TEST_CASE("data verify names the files that are missing and fails", "[data]") {
  const TemporaryFolder folder;
  const auto r = run_command({"data", "verify", "weights_vgg16", folder.path.string(), "--json", "-"});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.err,
             Contains("vgg16_conv1_1-conv2_2.safetensors: missing") && Contains("0 of 1 files are right"));
  const nlohmann::json json = nlohmann::json::parse(r.out);
  CHECK(json["ok"] == false);
  CHECK(json["faults"][0]["what"] == "missing");
}

TEST_CASE("data verify with a wrong name or folder", "[data]") {
  const auto name = run_command({"data", "verify", "weights_vgg", "."});
  CHECK(name.code == cli::kUsage);
  CHECK_THAT(name.err, Contains("no data set is called 'weights_vgg'; did you mean weights_vgg16?"));
  const auto folder = run_command({"data", "verify", "fox", "/no/such/folder"});
  CHECK(folder.code == cli::kFailed);
  CHECK(folder.err == "fieldmark: /no/such/folder: expected a folder\n");
  CHECK(run_command({"data"}).code == cli::kUsage);
  CHECK(run_command({"data", "verify", "fox"}).code == cli::kUsage);
}

TEST_CASE("data verify passes on the real files", "[data]") {
  const auto weights = data_or_skip("weights", "data verify on real files");
  if (!weights) return;
  const auto r = run_command({"data", "verify", "weights_lpips", weights->string()});
  INFO(r.out << r.err);
  CHECK(r.code == cli::kOk);
}
