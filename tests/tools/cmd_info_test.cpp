#include <fieldmark/core/files.h>
#include <fieldmark/engine/safetensors.h>

#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("info shows metadata and tensors", "[info]") {
  const TemporaryFolder folder;
  const std::string path = folder / "f.safetensors";
  SafetensorsFile file;
  file.metadata["fieldmark"] = R"({"kind": "field", "format": 1})";
  file.metadata["note"] = "not { JSON";
  file.add("weight", {2, 3}, std::vector<float>(6));
  file.add("bytes", {5}, std::vector<std::uint8_t>(5));
  file.write(path);

  const auto r = run_command({"info", path, "--json", "-"});
  CHECK(r.code == cli::kOk);
  CHECK_THAT(r.err, Contains("weight") && Contains("[2, 3]") && Contains("F32") &&
                        Contains("2 tensors, 11 elements"));
  const nlohmann::json json = nlohmann::json::parse(r.out);
  CHECK(json["metadata"]["fieldmark"]["kind"] == "field");
  CHECK(json["metadata"]["note"] == "not { JSON");
  CHECK(json["numbers"] == 11);
  CHECK(json["file_bytes"] == std::filesystem::file_size(path));
  CHECK(json["sha256"].get<std::string>().size() == 64);
  CHECK(json.at("networks_sha256").is_null());  // only an owner has networks to compare
  CHECK_THAT(r.err, !Contains("networks"));
  REQUIRE(json["tensors"].size() == 2);
  const auto want =
      nlohmann::json::parse(R"({"name": "weight", "dtype": "F32", "shape": [2, 3], "bytes": 24})");
  CHECK(std::ranges::count(json["tensors"], want) == 1);
}

TEST_CASE("info of what is not safetensors fails in one line that names the file", "[info]") {
  const TemporaryFolder folder;
  const std::string path = folder / "f.txt";
  write_file_atomically(path, "no safetensors here, only a line of text");
  for (const auto& bad : {path, (folder / "missing").string(), folder.path.string()}) {
    const auto r = run_command({"info", bad});
    CHECK(r.code == cli::kFailed);
    CHECK(r.out.empty());
    CHECK(r.err.starts_with("fieldmark: "));
    CHECK_THAT(r.err, Contains(bad));
    CHECK(std::count(r.err.begin(), r.err.end(), '\n') == 1);
  }
  CHECK(run_command({"info"}).code == cli::kUsage);
}
