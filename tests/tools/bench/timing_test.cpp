#include "timing.h"
#include <fieldmark/core/error.h>

#include <chrono>
#include <thread>
#include <vector>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("timing: the median of calls that take what they say") {
  const Timing t = time_calls([] { std::this_thread::sleep_for(std::chrono::milliseconds(3)); }, 5, 0);
  CHECK(t.least >= 0.003);
  CHECK(t.least <= t.seconds);
  CHECK(t.seconds <= t.most);
  int calls = 0;
  time_calls([&] { ++calls; }, 3, 0);
  CHECK(calls == 4);
  std::string turns;
  time_calls([&] { turns += 'a'; }, 2, 0, [&] { turns += 'b'; });
  CHECK(turns == "aabab");  // the first is the warm-up
  CHECK(median({3, 1, 2}) == 2);
  CHECK(median({4, 1}) == 2.5);
  CHECK_THROWS_WITH(median({}), "[median] numbers must not be empty");
  CHECK_THROWS_AS(time_calls([] {}, 0), ValueError);
  CHECK_THROWS_WITH(time_calls([] {}, 1, -1),
                    "[time_calls] runs must be at least 1 and least_seconds at least 0, got 1 and -1");
}

TEST_CASE("timing: this machine multiplies and adds, and has memory") {
  CHECK(peak_gflops() > 1);
  const double before = peak_megabytes();
  const std::vector<char> room(static_cast<std::size_t>(before + 64) << 20, 1);  // exceeds the previous peak
  CHECK(peak_megabytes() >= before + 32);
  CHECK(room.back() == 1);
}
