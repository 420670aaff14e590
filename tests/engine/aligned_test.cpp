#include <fieldmark/engine/aligned.h>

#include <cstdint>
#include <limits>
#include <new>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("aligned: memory starts on a cache line, much of it on a huge page") {
  for (std::size_t bytes : {0, 1, 63, 65, 100000}) {
    void* p = allocate_aligned(bytes);
    CHECK(reinterpret_cast<std::uintptr_t>(p) % 64 == 0);
    free_aligned(p);
  }
  void* p = allocate_aligned(std::size_t{5} << 20);
  CHECK(reinterpret_cast<std::uintptr_t>(p) % (std::size_t{2} << 20) == 0);
  free_aligned(p);
  CHECK_THROWS_AS(allocate_aligned(std::numeric_limits<std::size_t>::max()), std::bad_alloc);
}

TEST_CASE("aligned: a vector keeps its numbers while it grows") {
  AlignedVector<float> v;
  for (int i = 0; i < 3000000; ++i) v.push_back(static_cast<float>(i % 1000));
  CHECK(reinterpret_cast<std::uintptr_t>(v.data()) % 64 == 0);
  bool kept = true;
  for (int i = 0; i < 3000000; ++i)
    kept = kept && v[static_cast<std::size_t>(i)] == static_cast<float>(i % 1000);
  CHECK(kept);
}
