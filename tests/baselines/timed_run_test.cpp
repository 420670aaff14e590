#include <fieldmark/baselines/timed_run.h>
#include <fieldmark/core/files.h>

#include <algorithm>
#include <cstdlib>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {

// Counts to ten; its checkpoint is the number.
struct Counter {
  Index n = 0;
  std::vector<double> times;
  TimedRun run(const std::filesystem::path& checkpoint) {
    return {.what = "count",
            .seconds = 1,
            .done = [this] { return n == 10; },
            .step =
                [this](double seconds) {
                  times.push_back(seconds);
                  ++n;
                },
            .steps = [this] { return n; },
            .figure = [this] { return 0.5 * static_cast<double>(n); },
            .save = [this](const auto& path) { write_file_atomically(path, std::to_string(n)); },
            .restore = [this](const auto& path) { n = std::atoi(read_text(path).c_str()); },
            .checkpoint = checkpoint};
  }
};

}  // namespace

TEST_CASE("timed_run: a stopped run goes on where it was, and so does its clock") {
  const TemporaryFolder folder;
  const auto checkpoint = folder / "c";
  Counter first;
  CHECK_THROWS_AS(
      timed_run(first.run(checkpoint), [&](const auto&, double, const auto&) { return first.n < 4; }),
      Stopped);
  CHECK(read_text(checkpoint) == "4");
  write_file_atomically(folder / "c.seconds", "100.5\n");
  Counter second;
  std::vector<std::string> notes;
  const double seconds =
      timed_run(second.run(checkpoint), [&](const auto& what, double part, const auto& note) {
        CHECK(what == "count");
        CHECK(part == 1);
        notes.push_back(note);
        return true;
      });
  CHECK(second.times.size() == 6);
  CHECK(second.times.front() >= 100.5);
  CHECK(seconds >= second.times.back());
  CHECK(seconds < 160);
  CHECK(notes.front() == "step 5, 2.500");
  CHECK(run_curve(checkpoint).starts_with("seconds,steps,figure\n"));
  CHECK_THAT(run_curve(checkpoint), Contains(",10,5.0000\n"));
}

TEST_CASE("timed_run: what is done takes no step, until its files are removed") {
  const TemporaryFolder folder;
  const auto checkpoint = folder / "c";
  Counter first, second, third;
  timed_run(first.run(checkpoint), {});
  timed_run(second.run(checkpoint), {});
  CHECK(second.times.empty());
  CHECK(second.n == 10);
  remove_run_files(checkpoint);
  CHECK(folder.entries() == 0);
  remove_run_files(checkpoint);
  timed_run(third.run(checkpoint), {});
  CHECK(third.times.size() == 10);
}
