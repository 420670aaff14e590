#include "cli/cli.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("measure reports an owner's mark on several sets of cameras", "[measure]") {
  const TinyJob& job = TinyJob::get();
  for (const char* cameras : {"near", "ring", "sphere"}) {
    const auto r =
        run_command({"measure", "--owner", job.owner, "--cameras", cameras, "--count", "2", "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    const auto json = nlohmann::json::parse(r.out);
    CHECK(json["cameras"] == cameras);
    CHECK(json["views"] == 2);
    CHECK(json["baked"] == false);
    const double accuracy = json["accuracy"]["blind"];
    CHECK(accuracy >= 0);
    CHECK(accuracy <= 1);
  }
}

TEST_CASE("measure wants field and message together, and known distortions", "[measure]") {
  const TinyJob& job = TinyJob::get();
  CHECK(run_command({"measure", "--owner", job.owner, "--field", job.field}).code == cli::kUsage);
  CHECK(run_command({"measure", "--owner", job.owner, "--message", "5"}).code == cli::kUsage);
  CHECK(run_command({"measure", "--owner", job.owner, "--count", "1", "--under", "melt_3"}).code ==
        cli::kUsage);
  CHECK(run_command({"measure", "--owner", job.owner, "--count", "1", "--cameras", "test"}).code ==
        cli::kUsage);
  CHECK(run_command({"measure", "--owner", job.field, "--count", "1"}).code == cli::kFailed);
}
