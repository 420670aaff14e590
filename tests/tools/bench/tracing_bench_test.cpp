#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/tools/bench/tracing_bench.h>

#include "support/catch.h"
#include "watermark/small_owner.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("tracing_bench: names who took part, fewer of them as more copies are mixed, and nobody else") {
  const watermark::Owner owner = marking_owner();
  const TracingBenchOptions options{
      .cases = {{CopyMix::average, 1}, {CopyMix::average, 8}, {CopyMix::pasted, 2}},
      .recipients = 30,
      .repetitions = 3,
      .views = 4,
      .fpr = 1e-3,
      .seed = 3};
  std::vector<std::string> parts;
  const auto rows = run_tracing_bench(owner, options, [&](const std::string& what, double part) {
    CHECK((part >= 0 && part < 1));
    if (parts.empty() || parts.back() != what) parts.push_back(what);
  });
  CHECK(parts == std::vector<std::string>{"one copy", "average of 8", "pasted from 2"});
  REQUIRE(rows.size() == 3);
  for (const TracingRow& row : rows) {
    CAPTURE(row.copies.name(), row.found, row.worst_guilty, row.least_innocent);
    CHECK(row.repetitions == 3);
    CHECK(row.innocents_named == 0);
    CHECK(row.least_innocent > options.fpr);
    CHECK(row.found <= row.repetitions * row.copies.guilty);
  }
  CHECK(rows[0].all_found == 3);
  CHECK(rows[0].worst_guilty <= options.fpr);
  CHECK(rows[1].worst_guilty > rows[0].worst_guilty);
  CHECK(rows[2].worst_guilty > rows[0].worst_guilty);
}

TEST_CASE("tracing_bench: unmarked copies name nobody, and detection may be blind") {
  watermark::Owner owner = tiny_owner();
  owner.gain = 0;
  const auto rows = run_tracing_bench(
      owner,
      {.cases = {{CopyMix::average, 2}}, .recipients = 40, .repetitions = 2, .views = 2, .informed = false});
  REQUIRE(rows.size() == 1);
  CHECK(rows[0].found == 0);
  CHECK(rows[0].all_found == 0);
  CHECK(rows[0].worst_guilty > 1e-3);
}

TEST_CASE("tracing_bench: one and two threads give the same figures") {
  const watermark::Owner owner = marking_owner();
  const TracingBenchOptions options{
      .cases = {{CopyMix::average, 2}}, .recipients = 10, .repetitions = 1, .views = 2};
  const auto run = [&](int threads) {
    const ScopedThreads scope(threads);
    return run_tracing_bench(owner, options).front();
  };
  const TracingRow one = run(1), two = run(2);
  CHECK(one.worst_guilty == two.worst_guilty);
  CHECK(one.least_innocent == two.least_innocent);
}

TEST_CASE("tracing_bench: options outside their ranges are named") {
  const watermark::Owner owner = tiny_owner();
  CHECK_THROWS_WITH(run_tracing_bench(owner, {.recipients = 8}),
                    "[run_tracing_bench] recipients must be at least 9, got 8");
  CHECK_THROWS_WITH(run_tracing_bench(owner, {.cases = {{CopyMix::pasted, 0}}}),
                    "[run_tracing_bench] guilty must be at least 1, got 0");
  CHECK_THROWS_WITH(run_tracing_bench(owner, {.repetitions = 0}),
                    "[run_tracing_bench] repetitions must be at least 1, got 0");
  CHECK_THROWS_WITH(run_tracing_bench(owner, {.views = 0}),
                    "[run_tracing_bench] views must be at least 1, got 0");
  CHECK_THROWS_WITH(run_tracing_bench(owner, {.fpr = 0}), "[run_tracing_bench] fpr must be in (0, 1], got 0");
  CHECK_THROWS_WITH(run_tracing_bench(small_paper_owner(), {}), Contains("cells") && Contains("paper"));
}
