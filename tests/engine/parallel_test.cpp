#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("parallel: every index once, in chunks that do not depend on the thread count") {
  for (int n_threads : {1, 2, 3, 70}) {
    const ScopedThreads scope(n_threads);
    for (Index n : {0, 1, 7, 8, 9, 17, 1000}) {
      std::vector<int> seen(static_cast<std::size_t>(n));
      parallel_for(n, 8, [&](Index begin, Index end) {
        if (begin % 8 != 0 || end != std::min<Index>(begin + 8, n)) throw ValueError("another chunk");
        for (Index i = begin; i < end; ++i) ++seen[static_cast<std::size_t>(i)];
      });
      CHECK(seen == std::vector<int>(static_cast<std::size_t>(n), 1));
    }
  }
}

TEST_CASE("parallel: threads that are done take the chunks of one that is not") {
  const ScopedThreads scope(2);
  std::atomic<int> others{0};
  bool all_others_ran = false;
  parallel_for(64, 1, [&](Index b, Index) {
    if (b != 0) return static_cast<void>(++others);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (others < 63 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    all_others_ran = others == 63;
  });
  CHECK(all_others_ran);
}

TEST_CASE("parallel: a scope's number of threads ends with it, also by an exception") {
  const int before = threads();
  CHECK_THROWS_AS(
      [&] {
        const ScopedThreads scope(before + 3);
        CHECK(threads() == before + 3);
        throw ValueError("out");
      }(),
      ValueError);
  CHECK(threads() == before);
  CHECK_THROWS_WITH(ScopedThreads(0), Contains("n must be from 1 to 1024, got 0"));
  CHECK_THROWS_WITH(ScopedThreads(1025), Contains("n must be from 1 to 1024, got 1025"));
  CHECK(threads() == before);
}

TEST_CASE("parallel: an exception of a chunk reaches the caller, nested loops are serial") {
  CHECK_THROWS_WITH(parallel_for(100, 1,
                                 [](Index b, Index) {
                                   if (b == 50) throw ValueError("fifty");
                                 }),
                    "fifty");
  for (const int n_threads : {1, 2, 3})
    for (int repeat = 0; repeat < 50; ++repeat) {
      const ScopedThreads scope(n_threads);
      const auto late_first = [](Index b, Index) {
        // The first failing chunk does the most work, so that on several threads another fails before it.
        volatile double work = 0;
        if (b == 3)
          for (int i = 0; i < 20000; ++i) work = work + 1;
        if (b % 3 == 0 && b > 0) throw ValueError("chunk " + std::to_string(b));
      };
      CHECK_THROWS_WITH(parallel_for(64, 1, late_first), "chunk 3");
    }
  std::vector<int> seen(64);
  parallel_for(8, 1, [&](Index b, Index) {
    parallel_for(8, 1, [&](Index c, Index) { ++seen[static_cast<std::size_t>(8 * b + c)]; });
  });
  CHECK(seen == std::vector<int>(64, 1));
  CHECK_THROWS_WITH(set_threads(0), "[set_threads] n must be from 1 to 1024, got 0");
}
