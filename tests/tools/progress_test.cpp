#include "cli/progress.h"

#include <algorithm>
#include <csignal>
#include <regex>
#include <sstream>
#include <thread>

#include "support/catch.h"

using namespace fieldmark::cli;

TEST_CASE("format_duration changes its unit with the size", "[progress]") {
  CHECK(format_duration(0) == "0 s");
  CHECK(format_duration(-3) == "0 s");
  CHECK(format_duration(59.4) == "59 s");
  CHECK(format_duration(59.6) == "1 min 00 s");
  CHECK(format_duration(185) == "3 min 05 s");
  CHECK(format_duration(2 * 3600 + 7 * 60 + 12) == "2 h 07 min");
}

TEST_CASE("Progress away from a terminal is a line for each tenth", "[progress]") {
  std::ostringstream out;
  {
    Progress progress(out, "train");
    for (int i = 0; i <= 1000; ++i) progress.update(i / 1000.0, "loss 1");
    progress.update(1);
  }
  const std::string text = out.str();
  CHECK(std::count(text.begin(), text.end(), '\n') == 10);
  CHECK(text.find('\r') == std::string::npos);
  CHECK_THAT(text, Contains("train 10%  ") && Contains(" left  loss 1\n"));
  CHECK(std::regex_search(text, std::regex(R"(\ntrain 100%  in \d+ s)")));
}

TEST_CASE("Progress of a resumed run estimates the time left from its own work", "[progress]") {
  std::ostringstream out;
  Progress progress(out, "train");
  progress.update(0.5);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  progress.update(0.6);
  // 0.3 s for a tenth: 1.2 s for the rest, and not the 0.2 s of a run that did six tenths.
  CHECK(out.str().starts_with("train 50%  \ntrain 60%  "));
  CHECK_THAT(out.str(), Contains(" s left") && !Contains(" 0 s left"));
}

TEST_CASE("Progress on a terminal rewrites one line and ends it", "[progress]") {
  std::ostringstream out;
  {
    Progress progress(out, "train", true);
    progress.update(0.001, "a long note behind it");
    for (int i = 0; i < 1000; ++i) progress.update(0.5, "a long note behind it");
    progress.update(2);
  }
  const std::string text = out.str();
  CHECK(text.front() == '\r');
  CHECK(std::count(text.begin(), text.end(), '\r') < 100);  // of 1002 updates, on a busy machine too
  CHECK(std::count(text.begin(), text.end(), '\n') == 1);
  const auto last = text.substr(text.rfind('\r') + 1);
  CHECK(std::regex_search(last, std::regex(R"(^train 100%  in \d+ s   )")));
  CHECK(last.ends_with("   \n"));  // over a longer line
}

TEST_CASE("The first Ctrl-C sets a flag and the second one would kill", "[progress]") {
  {
    const InterruptGuard guard;
    CHECK(!guard.interrupted());
    std::raise(SIGINT);
    CHECK(guard.interrupted());
    CHECK(std::signal(SIGINT, SIG_DFL) == SIG_DFL);
  }
  const InterruptGuard again;
  CHECK(!again.interrupted());
}
