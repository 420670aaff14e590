#include <fieldmark/core/files.h>

#include "cli/cli.h"
#include "support/source_dir.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("bench tracing tells who was found in each case", "[bench]") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  const auto r =
      run_command({"bench", "tracing", "--owner", job.owner, "--recipients", "12", "--repetitions", "2",
                   "--views", "1", "--blind", "--json", "-", "--report", folder / "tracing.md"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["recipients"] == 12);
  CHECK(json["detection"] == "blind");
  CHECK(json["baked"] == false);
  REQUIRE(json["rows"].size() == 6);
  CHECK(json["rows"][0]["copies"] == "one copy");
  CHECK(json["rows"][5]["copies"] == "pasted from 3");
  for (const auto& row : json["rows"]) {
    CHECK(row["repetitions"] == 2);
    CHECK(row["found"].get<double>() <= 1);
    CHECK(row["all_found_low"].get<double>() <= row["all_found_high"].get<double>());
  }
  CHECK_THAT(r.err, Contains("12 recipients, 1 views, detection blind") && Contains("average of 8"));
  CHECK_THAT(read_text(folder / "tracing.md"), Contains("## rows"));
  CHECK(!json.contains("notes"));
}

TEST_CASE("bench tracing says that the bound of an owner of version 0.1 is not proven", "[bench]") {
  const auto r =
      run_command({"bench", "tracing", "--owner", source_dir() + "/tests/regression/version_0_1/owner.fm",
                   "--recipients", "9", "--repetitions", "1", "--views", "1", "--blind", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK_THAT(r.err, Contains("note: the networks of this owner file were trained under its own key"));
  CHECK_THAT(nlohmann::json::parse(r.out)["notes"].dump(), Contains("is not proven"));
}

TEST_CASE("bench tracing refuses a list that is too short", "[bench]") {
  const auto r = run_command({"bench", "tracing", "--owner", TinyJob::get().owner, "--recipients", "5"});
  CHECK(r.code == cli::kUsage);
  CHECK_THAT(r.err, Contains("--recipients") && Contains("9 to 10000000"));
}
