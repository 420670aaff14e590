#include <fieldmark/core/files.h>
#include <fieldmark/tools/bench/turns_bench.h>

#include <algorithm>
#include <filesystem>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
// A program that notes its name and arguments, and fails if the folder of its last argument is not empty.
std::string program(const TemporaryFolder& folder, const std::string& name, const std::string& then) {
  const auto path = folder / name;
  write_file_atomically(path, "#!/bin/sh\necho " + name + " \"$1\" >> '" + (folder / "log").string() +
                                  "'\ntest -z \"$(ls -A \"$2\")\" || exit 9\ntouch \"$2/used\"\n" + then +
                                  "\n");
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path.string();
}
}  // namespace

TEST_CASE("turns_bench: both programs run as often, pairs begin in turns, each run has an empty folder") {
  const TemporaryFolder folder;
  const TurnsOptions options{.ours = program(folder, "ours", "echo much"),
                             .theirs = program(folder, "theirs", "sleep 0.2"),
                             .arguments = {"two words", "{}"},
                             .runs = 3};
  std::vector<double> parts;
  const Turns turns = take_turns(options, [&](double part) { parts.push_back(part); });
  CHECK(read_text(folder / "log") ==
        "ours two words\ntheirs two words\ntheirs two words\nours two words\nours two words\ntheirs two "
        "words\n");
  CHECK(parts.front() == 0);
  CHECK(std::ranges::count(parts, 0.5) >= 1);
  CHECK(parts.back() == Approx(5.0 / 6));
  CHECK(std::ranges::is_sorted(parts));
  REQUIRE(turns.ours.size() == 3);
  REQUIRE(turns.theirs.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(turns.ours[i] > 0);
    CHECK(turns.theirs[i] >= 0.2);
  }
}

TEST_CASE("turns_bench: a program that fails, is missing or hangs is an error") {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& theirs, double limit) {
    return take_turns({.ours = program(folder, "ours", ""),
                       .theirs = theirs,
                       .arguments = {"x", "{}"},
                       .runs = 1,
                       .limit_seconds = limit},
                      [](double) {});
  };
  CHECK_THROWS_WITH(run(program(folder, "fails", "echo no such field >&2; exit 1"), 60),
                    Contains("fails: ended with exit code 1") && Contains("no such field"));
  CHECK_THROWS_WITH(run("/nowhere/fieldmark", 60), Contains("/nowhere/fieldmark: cannot be started"));
  CHECK_THROWS_WITH(run(program(folder, "hangs", "exec sleep 600"), 3),
                    Contains("hangs: did not end within 3 s"));
  CHECK_THROWS_WITH(take_turns({.runs = 0}, [](double) {}), "[take_turns] runs must be at least 1, got 0");
}

TEST_CASE("turns_bench: ratios are of pairs and of the fastest runs") {
  const TurnsRatio ratio = ratio_of({.ours = {2, 3, 8}, .theirs = {4, 2, 5}});
  CHECK(ratio.median == 1.5);
  CHECK(ratio.low == 0.5);
  CHECK(ratio.high == 1.6);
  CHECK(ratio.of_least == 1);
  CHECK_THROWS_WITH(ratio_of({}), Contains("got 0 and 0"));
  CHECK_THROWS_WITH(ratio_of({.ours = {1, 2}, .theirs = {1}}), Contains("got 2 and 1"));
}
