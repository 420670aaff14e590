#include <fieldmark/baselines/timed_run.h>

#include "support/catch.h"
#include "support/counting_run.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

TEST_CASE("timed_run: a stopped run resumes where it was, and so does its clock") {
  const TemporaryFolder folder;
  const auto checkpoint = folder / "c";
  CountingRun first;
  CHECK_THROWS_WITH(timed_run(first, "count", 1, checkpoint,
                              [&](const auto&, double, const auto&) { return first.steps() < 4; }),
                    "count: stopped after 4 steps, saved");
  CountingRun second;
  std::vector<std::string> notes;
  const double seconds =
      timed_run(second, "count", 1e-9, checkpoint, [&](const auto& what, double part, const auto& note) {
        CHECK(what == "count");
        CHECK(part == 1);
        notes.push_back(note);
        return true;
      });
  CHECK(second.times.size() == 6);
  CHECK(second.times.front() >= first.seconds());
  CHECK(first.seconds() > 0);
  CHECK(seconds >= second.times.back());
  CHECK(notes.front() == "step 4, a note");
  CHECK_THAT(second.curve(), Contains(",10,5.0000\n"));
}

TEST_CASE("timed_run: a complete run takes no step") {
  const TemporaryFolder folder;
  CountingRun first, second;
  timed_run(first, "count", 1, folder / "c", {});
  timed_run(second, "count", 1, folder / "c", {});
  CHECK(second.times.empty());
  CHECK(second.steps() == 10);
  CHECK(second.curve() == first.curve());
}
