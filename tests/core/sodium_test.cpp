#include <fieldmark/core/sodium.h>

#include <thread>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("sodium: several threads may initialise it, and it is initialised then") {
  std::thread other([] { ensure_sodium(); });
  ensure_sodium();
  other.join();
  CHECK(sodium_init() == 1);  // 1: already initialised
}
