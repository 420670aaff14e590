#include "support/catch.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("bench has a command for each subject, which refuses the options of others", "[bench]") {
  CHECK(run_command({"bench"}).code == cli::kUsage);
  CHECK(run_command({"bench", "nothing"}).code == cli::kUsage);
  const auto help = run_command({"bench", "--help"});
  CHECK(help.code == cli::kOk);
  for (const char* subject : {"engine", "field", "training", "embed", "payload", "attacks", "tracing"}) {
    CHECK_THAT(help.out, Contains(subject));
    CHECK_THAT(run_command({"bench", subject, "--help"}).out, Contains("--"));
  }
  CHECK(run_command({"bench", "payload", "--runs", "3"}).code == cli::kUsage);
  CHECK(run_command({"bench", "training", "--peer", "pytorch"}).code == cli::kUsage);
  CHECK(run_command({"bench", "field", "--field", "a", "--seconds", "3"}).code == cli::kUsage);
  CHECK(run_command({"bench", "embed", "--field", "a", "--owner", "b"}).code == cli::kUsage);
}
