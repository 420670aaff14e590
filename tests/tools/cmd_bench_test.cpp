#include "support/catch.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("bench has a command for each subject, which refuses the options of others", "[bench]") {
  CHECK(run_command({"bench"}).code == cli::kUsage);
  CHECK(run_command({"bench", "nothing"}).code == cli::kUsage);
  const auto help = run_command({"bench", "--help"});
  CHECK(help.code == cli::kOk);
  using Subject = std::pair<const char*, const char*>;  // and an option of its own
  for (const auto& [subject, option] :
       {Subject{"engine", "--peer"}, Subject{"field", "--size"}, Subject{"training", "--scene"},
        Subject{"embed", "--bits"}, Subject{"payload", "--trials"}, Subject{"attacks", "--attacked"},
        Subject{"tracing", "--recipients"}, Subject{"captures", "--degrees"},
        Subject{"collapse", "--patience"}, Subject{"data", "--place"}}) {
    CAPTURE(subject);
    CHECK_THAT(help.out, Contains(subject));
    const auto own = run_command({"bench", subject, "--help"});
    CHECK(own.code == cli::kOk);
    CHECK_THAT(own.out, Contains(option));
  }
  CHECK(run_command({"bench", "payload", "--runs", "3"}).code == cli::kUsage);
  CHECK(run_command({"bench", "training", "--peer", "pytorch"}).code == cli::kUsage);
  CHECK(run_command({"bench", "field", "--field", "a", "--seconds", "3"}).code == cli::kUsage);
  CHECK(run_command({"bench", "embed", "--field", "a", "--owner", "b"}).code == cli::kUsage);
}
