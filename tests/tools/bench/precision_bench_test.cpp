#include <fieldmark/core/error.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/tools/bench/precision_bench.h>

#include <algorithm>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("precision_bench: every variant is timed, and what is less exact is less exact") {
  std::vector<std::string> begun;
  const auto rows = run_precision_bench({.runs = 1, .scale = 0.01},
                                        [&](const std::string& name) { begun.push_back(name); });
  CHECK(begun.size() == 4);
  const auto error_of = [&](const std::string& variant) {
    const auto row =
        std::find_if(rows.begin(), rows.end(), [&](const auto& r) { return r.variant == variant; });
    REQUIRE(row != rows.end());
    CHECK(row->seconds > 0);
    CHECK(row->speedup > 0);
    CHECK(!row->measure.empty());
    return row->error;
  };
  CHECK(error_of("fp64") == 0);
  CHECK(error_of("fp32") > 0);
  CHECK(error_of("fp32") < 1e-6);
  CHECK(error_of("C library") < 1e-7);
  CHECK(error_of("polynomial of degree 6") < 3e-7);
  CHECK(error_of("direct") < 1e-6);
  CHECK(error_of("Winograd, F(4 x 4, 3 x 3)") < 2e-6);
  CHECK(error_of("transmittance threshold 1e-4") > error_of("transmittance threshold 1e-2"));
  if (bf16_units() != Bf16Units::none) {
    CHECK(error_of("bf16, dW in fp32") > 1e-4);
    // Measured 7.7e-2: one unit in a few hundred lies on the other side of its ReLU's kink.
    CHECK(error_of("bf16, dW in fp32") < 0.12);
    CHECK(error_of("default threshold, networks and table in bf16") > 35);
  }
}

TEST_CASE("precision_bench: errors") {
  CHECK_THROWS_WITH(run_precision_bench({.runs = 0}),
                    "[precision_bench] runs must be at least 1 and scale in (0, 1], got 0 and 1");
  const nerf::Dataset data;
  CHECK_THROWS_WITH(run_precision_bench({.train = &data}),
                    "[precision_bench] train and test must both be given, or none");
}
