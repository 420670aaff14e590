#include <fieldmark/engine/arena.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <span>
#include <vector>

#include "support/catch.h"

using fieldmark::Arena;

TEST_CASE("arena: blocks are aligned and do not overlap") {
  Arena arena(256);
  std::vector<std::span<char>> blocks;
  for (std::size_t n : {1, 63, 64, 65, 5000, 1, 0}) {
    auto* p = static_cast<char*>(arena.allocate(n));
    CHECK(reinterpret_cast<std::uintptr_t>(p) % Arena::kAlign == 0);
    std::memset(p, static_cast<int>(blocks.size()), n);
    blocks.emplace_back(p, n);
  }
  for (std::size_t k = 0; k < blocks.size(); ++k)
    CHECK(std::ranges::count(blocks[k], static_cast<char>(k)) == std::ssize(blocks[k]));
}

TEST_CASE("arena: a negative or overflowing size is an error, not an empty block") {
  Arena arena;
  const auto most = std::numeric_limits<std::size_t>::max();
  for (const std::size_t bytes : {most, most - 10, most / 2 + 1, static_cast<std::size_t>(-64)})
    CHECK_THROWS_AS(arena.allocate(bytes), std::bad_alloc);
  CHECK(arena.reserved() == 0);
}

TEST_CASE("arena: free memory and later blocks are spoilt on request, what is in use is not") {
  Arena arena(256);
  auto* used = static_cast<unsigned char*>(arena.allocate(64));
  used[63] = 1;
  arena.spoil();
  CHECK(used[63] == 1);
  const auto* next = static_cast<unsigned char*>(arena.allocate(64));
  const auto* grown = static_cast<unsigned char*>(arena.allocate(1000));
  CHECK((next[0] == 0xff && next[63] == 0xff));
  CHECK((grown[0] == 0xff && grown[999] == 0xff));
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

TEST_CASE("arena: what is in use grows by every allocation, over blocks too") {
  Arena arena(1024);
  CHECK(arena.used() == 0);
  std::size_t before = 0;
  for (const std::size_t bytes : {1u, 100u, 5000u, 64u}) {
    arena.allocate(bytes);
    CHECK(arena.used() >= before + bytes);
    CHECK(arena.used() <= arena.reserved());
    before = arena.used();
  }
  arena.reset();
  CHECK(arena.used() == 0);
}
