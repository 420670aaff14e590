#include <fieldmark/engine/chain.h>

#include <type_traits>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("chain_steps: the memory of a tape can hold the steps, and a byte the number of any value") {
  STATIC_REQUIRE(std::is_trivially_copyable_v<detail::ChainSteps>);
  STATIC_REQUIRE(std::is_trivially_destructible_v<detail::ChainSteps>);
  STATIC_REQUIRE(detail::kChainInputs + detail::kChainSteps <= 256);
}
