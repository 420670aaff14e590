#include <fieldmark/core/error.h>
#include <fieldmark/tools/bench/line_process.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
std::vector<std::string> shell(const std::string& script) { return {"/bin/sh", "-c", script}; }
std::string failure_of(LineProcess& process) {
  try {
    return "answered: " + process.read_line();
  } catch (const IoError& e) {
    return e.what();
  }
}
std::string failure(const std::string& script) {
  LineProcess process(shell(script), {}, 60);
  return failure_of(process);
}

// The program hangs after a first command. The limit of 1 s begins once that has run, however long it takes.
std::string failure_of_hanging(const std::string& first) {
  const TemporaryFolder folder;
  const std::string ready = folder / "ready";
  LineProcess process(shell(first + "; : >'" + ready + "'; exec sleep 600"), {}, 1);
  for (int ms = 0; ms < 60000 && !std::filesystem::exists(ready); ++ms)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  REQUIRE(std::filesystem::exists(ready));
  return failure_of(process);
}
}  // namespace

TEST_CASE("line_process: lines go both ways, with the environment that was asked for") {
  ::setenv("FIELDMARK_TEST_OLD", "kept", 1);
  ::setenv("FIELDMARK_TEST_NEW", "not seen", 1);
  LineProcess process(
      shell("echo $FIELDMARK_TEST_OLD $FIELDMARK_TEST_NEW; while read -r x; do echo \"<$x>\"; done"),
      {"FIELDMARK_TEST_NEW=new"}, 60);
  CHECK(process.read_line() == "kept new");
  for (const std::string line : {"one", "", "two words"}) {
    process.write_line(line);
    CHECK(process.read_line() == "<" + line + ">");
  }
}

TEST_CASE("line_process: a program that ends says why") {
  CHECK(failure("exit 3") ==
        "/bin/sh: ended with exit code 3 before it answered, with no message on standard error");
  CHECK(failure("printf 'no line'; for i in 1 2 3 4 5 6 7; do echo word $i >&2; done; exit 1") ==
        "/bin/sh: ended with exit code 1 before it answered:\nword 3\nword 4\nword 5\nword 6\nword 7");
  CHECK(failure("echo alone >&2; kill -9 $$") ==
        "/bin/sh: was killed by signal 9 before it answered:\nalone");
  CHECK_THROWS_WITH(LineProcess({"/nowhere/python3"}, {}, 1),
                    "/nowhere/python3: cannot be started (No such file or directory)");
  CHECK_THROWS_AS(LineProcess({}, {}, 1), ValueError);
  CHECK_THROWS_WITH(LineProcess(shell("exit"), {}, 0),
                    "[LineProcess] command must not be empty and limit_seconds above 0, got '/bin/sh' and 0");
}

TEST_CASE("line_process: a program that is only to run is waited for, whatever it writes") {
  LineProcess talks(shell("echo ready; head -c 3000000 /dev/zero | tr '\\0' x; exec sleep 0.05"), {}, 60);
  CHECK(talks.read_line() == "ready");
  talks.finish();
  LineProcess fails(shell("echo no room >&2; exit 7"), {}, 60);
  CHECK_THROWS_WITH(fails.finish(), "/bin/sh: ended with exit code 7:\nno room");
  LineProcess sleeps(shell("exec sleep 600"), {}, 0.2);
  CHECK_THROWS_WITH(sleeps.finish(), "/bin/sh: did not end within 0.2 s, with no message on standard error");
  LineProcess(shell("cat >&2"), {}, 60).finish();  // its input ends
}

TEST_CASE("line_process: who waits for a program may give up, also if the program failed") {
  struct GivenUp {};
  const auto begin = std::chrono::steady_clock::now();
  pid_t pid = 0;
  {
    LineProcess sleeps(shell("echo $$; exec sleep 600"), {}, 600);
    pid = static_cast<pid_t>(std::stol(sleeps.read_line()));
    int ticks = 0;
    CHECK_THROWS_AS(sleeps.finish([&] {
      if (++ticks == 3) throw GivenUp();
    }),
                    GivenUp);
    CHECK(ticks == 3);
  }
  CHECK(::kill(pid, 0) != 0);
  bool failed = false;
  LineProcess fails(shell("exit 130"), {}, 60);
  CHECK_THROWS_AS(fails.finish([&] {
    if (failed) throw GivenUp();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    failed = true;
  }),
                  GivenUp);
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(60));
}

TEST_CASE("line_process: what hangs or never ends its line is killed in time") {
  const auto begin = std::chrono::steady_clock::now();
  CHECK(failure_of_hanging("echo thinking >&2") == "/bin/sh: no answer within 1 s:\nthinking");
  CHECK(failure_of_hanging("exec >&- <&-") ==
        "/bin/sh: closed its output before it answered, with no message on standard error");
  CHECK(failure("exec tr '\\0' x </dev/zero") ==
        "/bin/sh: an answer without an end, with no message on standard error");
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(60));
}

TEST_CASE(
    "line_process: a program that is gone is noticed when it is asked, and does not outlive its object") {
  LineProcess gone(shell("echo ready; exit 4"), {}, 60);
  CHECK(gone.read_line() == "ready");
  for (int i = 0; i < 3; ++i) gone.write_line("are you there");
  CHECK_THROWS_WITH(gone.read_line(), Contains("ended with exit code 4"));
  pid_t pid = 0;
  {
    LineProcess sleeps(shell("echo $$; exec sleep 600"), {}, 60);
    pid = static_cast<pid_t>(std::stol(sleeps.read_line()));
    CHECK(::kill(pid, 0) == 0);
  }
  CHECK(::kill(pid, 0) == -1);
}
