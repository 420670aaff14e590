#include "cli/command_line.h"

#include <string>

#include "support/catch.h"
#include "tools/run_command.h"

TEST_CASE("command_line: NaN and infinity are refused wherever a number is expected") {
  for (const char* number : {"nan", "inf", "-inf", "NAN"}) {
    const Outcome r = run_command({"verify", "--owner", "o", "--message", "a5", "--fpr", number, "view.png"});
    CHECK(r.code == 2);
    CHECK_THAT(r.err, Contains("--fpr") && Contains("expected a finite number, got " + std::string(number)));
  }
}

TEST_CASE("command_line: a seed is a whole number from 0") {
  const Outcome r = run_command({"scene", "--out", "nowhere", "--seed", "-1"});
  CHECK(r.code == 2);
  CHECK_THAT(r.err, Contains("--seed"));
}
