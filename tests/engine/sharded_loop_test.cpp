#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/sharded_loop.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"

using namespace fieldmark;

namespace {
// A body whose float sum depends on the order of additions.
std::vector<float> run(int n_threads, Index chunks) {
  const ScopedThreads scope(n_threads);
  ShardedLoop<float> loop(16, 3);
  std::vector<float> into(3, 1.f);
  std::vector<Index> shards(at(chunks), -1);
  const double loss = loop.run(
      chunks,
      [&](Index c, Index shard, Tape<float>&, float* g) {
        // Catch2's checks are not thread-safe: the findings of a chunk are checked below.
        shards[at(c)] = shard;
        for (int k = 0; k < 3; ++k) g[k] += std::sin(static_cast<float>(c * 3 + k)) * 1e3f;
        return static_cast<double>(c);
      },
      into);
  CHECK(std::all_of(shards.begin(), shards.end(), [](Index s) { return s >= 0 && s < 16; }));
  CHECK(loss == static_cast<double>(chunks * (chunks - 1) / 2));
  return into;
}
}  // namespace

TEST_CASE("sharded_loop: same bits for 1, 2 and 3 threads and adds onto what was there") {
  for (Index chunks : {0, 1, 5, 16, 1001}) {
    const auto one = run(1, chunks);
    CHECK(one == run(2, chunks));
    CHECK(one == run(3, chunks));
    for (Index k = 0; k < 3; ++k) {
      double sum = 1;
      for (Index c = 0; c < chunks; ++c) sum += 1e3 * std::sin(static_cast<double>(c * 3 + k));
      CHECK(one[at(k)] == Approx(sum).margin(1e-2));
    }
  }
}

TEST_CASE("sharded_loop: errors") {
  CHECK_THROWS_WITH(ShardedLoop<float>(0, 1), "[sharded_loop] shards must be 1 to 256, got 0");
  ShardedLoop<float> loop(2, 1);
  std::vector<float> into(2);
  CHECK_THROWS_WITH(loop.run(
                        1, [](Index, Index, Tape<float>&, float*) { return 0.0; }, into),
                    "[sharded_loop] into must have at most 1 numbers, got 2");
  CHECK_THROWS_AS(loop.run(
                      3, [](Index, Index, Tape<float>&, float*) -> double { throw ValueError("x"); },
                      std::span<float>(into).first(1)),
                  ValueError);
}
