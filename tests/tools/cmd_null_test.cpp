#include <fieldmark/core/files.h>

#include "cli/cli.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("null counts the key and random keys on unmarked images beside their bounds", "[null]") {
  const TinyJob& job = TinyJob::get();
  const auto r = run_command({"null", "--owner", job.owner, "--keys", "400", "--novel", "3", "--detection",
                              "blind", job.images(), "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["n"] == 5);
  CHECK(json["key_free"] == true);
  CHECK(json["random_keys"]["n"] == 2000);
  CHECK_THAT(json["notes"].dump(), Contains("views of one field") && Contains("not independent trials"));
  for (const char* p : {"1e-1", "1e-2", "1e-3"}) {
    CHECK(json["counts"][p] <= json["bounds"][p]);
    CHECK(json["random_keys"]["counts"][p] <= json["random_keys"]["bounds_99"][p]);
  }
  CHECK(json["random_keys"]["counts"]["1e-1"] > 0);
  CHECK(json["detection"] == "blind");
}

TEST_CASE("null needs images, and can do without random keys", "[null]") {
  const TinyJob& job = TinyJob::get();
  const auto none = run_command({"null", "--owner", job.owner});
  CHECK(none.code == cli::kUsage);
  CHECK_THAT(none.err, Contains("images: expected unmarked images or --novel N, got neither"));
  const auto unread = run_command({"null", "--owner", job.owner, "--novel", "2", "--readings", "r"});
  CHECK(unread.code == cli::kUsage);
  CHECK_THAT(unread.err, Contains("--readings: needs images or videos, got none"));
  const auto late =
      run_command({"null", "--owner", job.owner, "--novel", "2", "--readings", "/no/folder/r", job.images()});
  CHECK(late.code == cli::kFailed);
  CHECK_THAT(late.err, Contains("/no/folder/r") && !Contains("novel views"));
  const auto r = run_command({"null", "--owner", job.owner, "--message", "5", "--keys", "0", "--detection",
                              "blind", job.images(), "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK_FALSE(nlohmann::json::parse(r.out).contains("random_keys"));
}
