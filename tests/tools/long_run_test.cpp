#include "cli/long_run.h"

#include <csignal>
#include <sstream>

#include "cli/cli.h"
#include "cli/context.h"
#include "support/catch.h"
#include "support/counting_run.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::cli;

TEST_CASE("run_long takes the steps and shows how far it is", "[long_run]") {
  const TemporaryFolder folder;
  std::ostringstream out, err;
  Context context({}, {}, out, err);
  CountingRun run(5);
  CHECK(run_long(run, "count", {.steps = 5}, context, folder / "c") >= 0);
  CHECK(run.steps() == 5);
  CHECK(folder.entries() == 0);
  CHECK_THAT(err.str(), Contains("count 20%") && Contains("step 5  a note"));
}

TEST_CASE("run_long saves and stops at Ctrl-C", "[long_run]") {
  const TemporaryFolder folder;
  const std::string checkpoint = folder / "c";
  std::ostringstream out, err;
  Context context({}, {}, out, err);
  CountingRun run(5);
  run.in_step = [&] {
    if (run.steps() == 1) std::raise(SIGINT);
  };
  CHECK_THROWS_WITH(run_long(run, "count", {.steps = 5}, context, checkpoint),
                    Contains("after 2 steps, --resume continues from " + checkpoint));
  CHECK(run.steps() == 2);
  CountingRun later(5);
  later.restore(checkpoint);
  CHECK(later.steps() == 2);
  CountingRun unsaved(5);
  unsaved.in_step = [] { std::raise(SIGINT); };
  CHECK_THROWS_WITH(run_long(unsaved, "count", {.steps = 5}, context), Contains("nothing was written"));
}
