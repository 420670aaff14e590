#include "cli/precision.h"

#include <fieldmark/engine/isa.h>

#include "cli/cli.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::cli;

TEST_CASE("precision: float is there on every CPU, bf16 where there are products of it") {
  CHECK(precision_of("fp32") == Precision::fp32);
  if (bf16_units() != Bf16Units::none) CHECK(precision_of("bf16") == Precision::bf16);
  const ScopedIsa scope(Isa::v2);
  CHECK(precision_of("fp32") == Precision::fp32);
  CHECK_THROWS_WITH(precision_of("bf16"),
                    "--precision bf16: this CPU has no bf16 products with the kernels v2");
}
