#include "cli/long_run.h"

#include <csignal>
#include <sstream>
#include <thread>

#include "cli/cli.h"
#include "cli/context.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::cli;

namespace {

struct Counter {
  Index steps = 0, saved = 0, last = 5;
  Index interrupt_at = -1;
  Work work(bool can_save) {
    return {.what = "count",
            .done = [this] { return steps >= last; },
            .step =
                [this](double) {
                  if (++steps == interrupt_at) std::raise(SIGINT);
                },
            .steps = [this] { return steps; },
            .note = [] { return std::string("a note"); },
            .save = can_save ? std::function<void()>([this] { ++saved; }) : nullptr,
            .checkpoint = "x.checkpoint"};
  }
};

}  // namespace

TEST_CASE("run_long takes the steps and shows how far it is", "[long_run]") {
  std::ostringstream out, err;
  Context context({}, {}, out, err);
  Counter counter;
  CHECK(run_long(counter.work(true), {.steps = 5}, context) >= 0);
  CHECK(counter.steps == 5);
  CHECK(counter.saved == 0);
  CHECK_THAT(err.str(), Contains("count 20%") && Contains("step 5  a note"));
}

TEST_CASE("run_long saves and stops at Ctrl-C", "[long_run]") {
  std::ostringstream out, err;
  Context context({}, {}, out, err);
  Counter counter;
  counter.interrupt_at = 2;
  CHECK_THROWS_WITH(run_long(counter.work(true), {.steps = 5}, context),
                    Contains("after 2 steps, --resume continues from x.checkpoint"));
  CHECK(counter.steps == 2);
  CHECK(counter.saved == 1);
  counter = {.interrupt_at = 3};
  CHECK_THROWS_WITH(run_long(counter.work(false), {.steps = 5}, context), Contains("nothing was written"));
  CHECK(counter.saved == 0);
}

TEST_CASE("run_long saves now and then", "[long_run]") {
  std::ostringstream out, err;
  Context context({}, {}, out, err);
  Counter counter;
  Work work = counter.work(true);
  const auto step = work.step;
  work.step = [&](double seconds) {
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
    step(seconds);
  };
  run_long(work, {.steps = 5, .checkpoint_seconds = 0.002}, context);
  CHECK(counter.saved == 4);
}
