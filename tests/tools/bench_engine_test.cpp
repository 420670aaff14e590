#include <fieldmark/core/files.h>

#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "support/torch.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("bench engine prints a row each, and the figures that scripts read", "[bench]") {
  const TemporaryFolder folder;
  const auto r = run_command({"bench", "engine", "--runs", "1", "--scale", "0.01", "--only", "mlp_4x64_t",
                              "--json", "-", "--plot", folder / "plot.svg"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["peak_gflops"].get<double>() > 1);
  CHECK(json["isa"].get<std::string>().size() == 2);
  REQUIRE(json["rows"].size() == 1);
  CHECK_FALSE(json.contains("precision"));
  for (const char* key : {"name", "gflops", "ratio_to_peak", "error", "peer_ratio"})
    CHECK(json["rows"][0].contains(key));
  CHECK(json["rows"][0]["name"] == "mlp_4x64_tape_fb_f32");
  CHECK_THAT(r.err, Contains("of peak"));
  CHECK(std::filesystem::file_size(folder / "plot.svg") > 500);
}

TEST_CASE("bench engine --precision adds speed against error, on a scene that is named", "[bench]") {
  const TemporaryFolder folder;
  REQUIRE(run_command({"scene", "--out", folder / "ball", "--kind", "sphere", "--size", "16", "--views", "4"})
              .code == cli::kOk);
  const auto r =
      run_command({"bench", "engine", "--runs", "1", "--scale", "0.01", "--only", "nerf_step", "--precision",
                   "--scene", folder / "ball", "--json", "-", "--report", folder / "engine.md"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["rows"][0]["what"] == "training step of the default field on ball");
  REQUIRE(json["precision"].size() > 8);
  for (const char* key : {"work", "variant", "seconds", "speedup", "error", "measure"})
    CHECK(json["precision"][0].contains(key));
  CHECK(std::filesystem::file_size(folder / "engine.md") > 500);
  CHECK_THAT(run_command({"bench", "engine", "--scene", "/nowhere/scene"}).err, Contains("/nowhere/scene"));
}

TEST_CASE("bench engine --peer pytorch adds its figures to every row, and fails where it cannot", "[bench]") {
  const auto missing = run_command({"bench", "engine", "--runs", "1", "--scale", "0.01", "--only", "conv3x3",
                                    "--peer", "pytorch", "--python", "/nowhere/python3"});
  CHECK(missing.code == cli::kFailed);
  CHECK_THAT(missing.err, Contains("/nowhere/python3: cannot be started"));
  if (!torch_or_skip("bench engine --peer pytorch")) return;
  const TemporaryFolder folder;
  const auto r = run_command({"bench", "engine", "--runs", "1", "--scale", "0.01", "--only", "mlp_4x64",
                              "--peer", "pytorch", "--json", "-", "--report", folder / "engine.md", "--plot",
                              folder / "engine.svg"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["peer"]["name"] == "pytorch");
  for (const char* key : {"version", "threads", "blas", "cpu_capability", "tuned_environment"})
    CHECK(json["peer"].contains(key));
  const auto& row = json["rows"][0];
  CHECK(row["peer_ratio"].get<double>() ==
        Approx(row["peer_seconds"].get<double>() / row["seconds"].get<double>()));
  CHECK(row["gradient_difference"].get<double>() > 0);
  CHECK(row["peer_untuned_seconds"].get<double>() > 0);
  CHECK(row["peer_variant"].is_string());
  CHECK(json["rows"][1]["name"] == "mlp_4x64_tape_fb_f32");
  CHECK(json["rows"][1]["peer_ratio"].is_null());
  CHECK(row["peer_ratio_at_peak"].get<double>() * row["ratio_to_peak"].get<double>() ==
        Approx(row["peer_ratio"].get<double>()));
  CHECK(json["rows"][1]["peer_ratio_at_peak"].is_null());
  CHECK(json["rows"][1]["peer_seconds"].is_null());
  CHECK_THAT(r.err, Contains("PyTorch") && Contains("ratio"));
  const std::string report = read_text(folder / "engine.md");
  CHECK_THAT(report, Contains("| peer.version | ") && Contains("| peer_variant | "));
  CHECK_THAT(read_text(folder / "engine.svg"), Contains("x our time"));
}

TEST_CASE("bench engine with rows or peers there are not, is a usage error", "[bench]") {
  CHECK(run_command({"bench", "engine", "--only", "nothing"}).code == cli::kUsage);
  CHECK(run_command({"bench", "engine", "--scale", "2"}).code == cli::kUsage);
  CHECK(run_command({"bench", "engine", "--peer", "nobody"}).code == cli::kUsage);
  CHECK(run_command({"bench", "engine", "--python", "/usr/bin/python3"}).code == cli::kUsage);
  const auto scene = run_command({"bench", "engine", "--only", "hash", "--scene", "s"});
  CHECK(scene.code == cli::kUsage);
  CHECK_THAT(scene.err, Contains("--scene: no row that --only selects trains on a scene"));
  const auto r = run_command({"bench", "engine", "--only", "hash", "--peer", "pytorch"});
  CHECK(r.code == cli::kUsage);
  CHECK_THAT(r.err, Contains("no row with 'hash' in its name has one"));
}
