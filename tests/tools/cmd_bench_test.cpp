#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("bench engine prints a row each, and the figures that scripts read", "[bench]") {
  const TemporaryFolder folder;
  const auto r = run_command({"bench", "engine", "--runs", "1", "--scale", "0.01", "--only", "mlp_4x64",
                              "--json", "-", "--plot", folder / "plot.svg"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["peak_gflops"].get<double>() > 1);
  CHECK(json["isa"].get<std::string>().size() == 2);
  REQUIRE(json["rows"].size() == 2);
  for (const char* key : {"name", "gflops", "ratio_to_peak", "error", "peer_ratio"})
    CHECK(json["rows"][0].contains(key));
  CHECK(json["rows"][0]["name"] == "mlp_4x64_fb_f32");
  CHECK_THAT(r.err, Contains("of peak"));
  CHECK(std::filesystem::file_size(folder / "plot.svg") > 500);
}

TEST_CASE("bench of what there is not, or of rows there are not, is a usage error", "[bench]") {
  CHECK(run_command({"bench", "nothing"}).code == cli::kUsage);
  CHECK(run_command({"bench", "engine", "--only", "nothing"}).code == cli::kUsage);
  CHECK(run_command({"bench", "engine", "--scale", "2"}).code == cli::kUsage);
}
