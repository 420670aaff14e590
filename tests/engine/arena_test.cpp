#include <fieldmark/engine/arena.h>

#include <cstdint>
#include <cstring>

#include "support/catch.h"

using fieldmark::Arena;

TEST_CASE("arena: blocks are aligned and do not overlap") {
  Arena arena(256);
  char* last = nullptr;
  for (std::size_t n : {1, 63, 64, 65, 5000, 0}) {
    auto* p = static_cast<char*>(arena.allocate(n));
    CHECK(reinterpret_cast<std::uintptr_t>(p) % Arena::kAlign == 0);
    CHECK(p != last);
    std::memset(p, 1, n);
    last = p;
  }
}

TEST_CASE("arena: the second round of equal requests calls the system no more") {
  Arena arena(64);
  for (int round = 0; round < 3; ++round) {
    const auto before = arena.system_calls();
    arena.reset();
    for (std::size_t n : {100, 3000, 70000, 12}) arena.allocate(n);
    if (round > 0) CHECK(arena.system_calls() == before);
  }
  CHECK(arena.reserved() >= 73112);
}
