#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/tools/bench/payload_bench.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("payload_bench: fewer payloads are exact as more bits are wrong, and strengths help") {
  const PayloadBenchOptions options{
      .bits = 100, .trials = 100, .noise_trials = 100, .error_rates = {0, 0.1, 0.2}, .seed = 2};
  int parts = 0;
  const PayloadBench result = run_payload_bench(options, [&](const std::string&, double part) {
    CHECK(part >= 0);
    CHECK(part < 1);
    ++parts;
  });
  CHECK(parts == 4);
  CHECK(result.data_bits == 40);
  REQUIRE(result.rows.size() == 3);
  CHECK(result.rows[0].signs.share() == 1);
  CHECK(result.rows[0].strengths.share() == 1);
  CHECK(result.rows[0].computed == 1);
  for (const auto& row : result.rows) {
    CHECK(row.signs.trials == 100);
    // The code reads at least its guaranteed share, up to 4 standard deviations.
    CHECK(row.signs.share() >= row.computed - 4 * std::sqrt(row.computed * (1 - row.computed) / 100));
  }
  // At most 9 wrong bits of 100, from the logarithms of factorials.
  double computed = 0;
  for (int k = 0; k <= 9; ++k)
    computed += std::exp(std::lgamma(101.0) - std::lgamma(k + 1.0) - std::lgamma(101.0 - k) +
                         k * std::log(0.1) + (100 - k) * std::log(0.9));
  CHECK(result.rows[1].computed == Approx(computed).epsilon(1e-9));
  CHECK(result.rows[1].strengths.exact > result.rows[1].signs.exact);
  CHECK(result.rows[2].strengths.exact < result.rows[1].strengths.exact);
  CHECK(result.noise.trials == 100);
  CHECK(result.noise.bound < 5e-3);
  CHECK(static_cast<double>(result.noise.signs) < 100 * result.noise.bound + 6);
  CHECK(static_cast<double>(result.noise.strengths) < 100 * result.noise.bound + 6);
}

TEST_CASE("payload_bench: equal for one and two threads, and errors are named") {
  const PayloadBenchOptions options{.bits = 40, .trials = 40, .noise_trials = 40, .error_rates = {0.08}};
  const ScopedThreads serial(1);
  const PayloadBench one = run_payload_bench(options);
  const ScopedThreads parallel(2);
  const PayloadBench two = run_payload_bench(options);
  CHECK(one.rows[0].signs.exact == two.rows[0].signs.exact);
  CHECK(one.rows[0].strengths.exact == two.rows[0].strengths.exact);
  CHECK(one.rows[0].strengths.corrected == two.rows[0].strengths.corrected);
  CHECK_THROWS_WITH(run_payload_bench({.trials = 0}),
                    "[run_payload_bench] trials must be at least 1, got 0 and 10000");
  CHECK_THROWS_WITH(run_payload_bench({.error_rates = {0.5}}),
                    "[run_payload_bench] error_rates must be in [0, 0.5), got 0.5");
  CHECK_THROWS_AS(run_payload_bench({.bits = 16}), ValueError);
}
