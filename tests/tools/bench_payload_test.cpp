#include <fieldmark/core/files.h>

#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("bench payload tells how often payloads are exact, and how often noise is one", "[bench]") {
  const TemporaryFolder folder;
  const auto r = run_command({"bench", "payload", "--bits", "64", "--trials", "20", "--json", "-", "--report",
                              folder / "payload.md"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["data_bits"] == 40);
  REQUIRE(json["rows"].size() == 11);
  CHECK(json["rows"][0]["strengths"] == 1);
  for (const char* key :
       {"error_rate", "computed", "signs", "signs_low", "signs_high", "signs_wrong", "strengths"})
    CHECK(json["rows"][10].contains(key));
  CHECK(json["fair_bits"]["trials"] == 200);
  CHECK(json["fair_bits"]["chance_bound"].get<double>() > 0);
  CHECK(json["layouts"].size() == 4);
  CHECK_THAT(r.err, Contains("40 data bits in 64") && Contains("fair bits read as a payload"));
  CHECK_THAT(read_text(folder / "payload.md"), Contains("## layouts") && Contains("## rows"));
  const auto few = run_command({"bench", "payload", "--bits", "16", "--trials", "1"});
  CHECK(few.code == cli::kUsage);
  CHECK_THAT(few.err, Contains("--bits"));
}
