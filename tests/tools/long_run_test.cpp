#include "cli/long_run.h"

#include <chrono>
#include <csignal>
#include <sstream>
#include <thread>

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
  run.in_step = [] { std::this_thread::sleep_for(std::chrono::milliseconds(5)); };
  CHECK(run_long(run, "count", {.steps = 5}, context, folder / "c") >= 0.025);
  CHECK(run.steps() == 5);
  CHECK(folder.entries() == 0);
  CHECK_THAT(err.str(), Contains("count 20%") && Contains("step 5  a note"));
}

TEST_CASE("run_long counts the seconds and steps of the run that it resumes", "[long_run]") {
  const TemporaryFolder folder;
  std::ostringstream out, err;
  Context context({}, {}, out, err);
  CountingRun run(5);
  run.in_step = [&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    if (run.steps() == 2) std::raise(SIGINT);
  };
  CHECK_THROWS_AS(run_long(run, "count", {.steps = 5}, context, folder / "c"), Interrupted);
  CountingRun later(5);
  later.restore(folder / "c");
  std::ostringstream shown;
  Context resumed({}, {}, shown, shown);
  // A timed run that has fixed its steps ends by them: the progress is theirs, not that of the clock.
  CHECK(run_long(later, "count", {.seconds = 1000}, resumed) >= 0.18);
  CHECK_THAT(shown.str(), Contains("count 80%") && Contains("step 5  a note"));
  CHECK_THAT(shown.str(), Contains("fixed its length at 5 steps, so --seconds does not change it"));
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
