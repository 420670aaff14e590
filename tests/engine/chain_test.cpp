#include <fieldmark/engine/chain.h>

#include "support/catch.h"

using namespace fieldmark;
using detail::ChainOp;

TEST_CASE("chain: steps name their operands, and what follows the result is dropped") {
  Chain chain(2);
  const Lane x = chain.input(0), z = chain.input(1), product = x * z, y = product + 3.0;
  exp(y);
  chain.finish(y);
  const detail::ChainSteps& steps = chain.steps();
  REQUIRE(steps.count == 2);
  CHECK(steps.step[0].op == ChainOp::mul);
  CHECK((steps.step[0].a == 0 && steps.step[0].b == 1));
  CHECK(steps.step[1].op == ChainOp::affine);
  CHECK((steps.step[1].a == 2 && steps.step[1].p == 1 && steps.step[1].q == 3));
}

TEST_CASE("chain: an input as the result is a step of its own") {
  Chain chain(1);
  chain.finish(chain.input(0));
  REQUIRE(chain.steps().count == 1);
  CHECK((chain.steps().step[0].p == 1 && chain.steps().step[0].q == 0));
}

TEST_CASE("chain: errors") {
  CHECK_THROWS_WITH(Chain(0), "[fused] inputs must be 1 to 8, got 0");
  CHECK_THROWS_WITH(Chain(9), "[fused] inputs must be 1 to 8, got 9");
  Chain chain(1), other(1);
  CHECK_THROWS_WITH(chain.input(1), "[fused] the chain has inputs 0 to 0, got 1");
  CHECK_THROWS_WITH(chain.input(0) + other.input(0), Contains("belongs to another chain"));
  CHECK_THROWS_WITH(chain.finish(other.input(0)), Contains("belongs to another chain"));
  CHECK_THROWS_WITH(chain.steps(), Contains("no result yet"));
  CHECK_THROWS_WITH(chain.input(0) / 0.0, "[div] divisor must not be 0");
  Lane x = chain.input(0);
  for (int s = 0; s < Chain::kMaxSteps; ++s) x = exp(x);
  CHECK_THROWS_WITH(exp(x), Contains("at most 32 steps"));
}
