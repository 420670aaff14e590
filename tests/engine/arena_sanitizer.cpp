// Tests the arena under the address sanitizer in every build: the program compiles the arena's sources
// itself. Returns the number of the first failed expectation.
#include <fieldmark/engine/arena.h>
#include <sanitizer/asan_interface.h>

using fieldmark::Arena;

int main() {
  Arena arena(4096);
  const auto* first = static_cast<char*>(arena.allocate(100));
  const auto* full = static_cast<char*>(arena.allocate(Arena::kAlign));  // no slack behind it
  const auto* last = static_cast<char*>(arena.allocate(8));
  if (__asan_region_is_poisoned(const_cast<char*>(first), 100)) return 1;
  if (!__asan_address_is_poisoned(first + 100)) return 2;
  if (__asan_region_is_poisoned(const_cast<char*>(full), Arena::kAlign)) return 3;
  if (!__asan_address_is_poisoned(full + Arena::kAlign)) return 4;
  if (!__asan_address_is_poisoned(last + 8)) return 5;
  arena.spoil();
  if (!__asan_address_is_poisoned(last + 8)) return 6;
  arena.reset();
  if (!__asan_address_is_poisoned(first)) return 7;
  if (__asan_address_is_poisoned(arena.allocate(1))) return 8;
  if (!__asan_address_is_poisoned(full)) return 9;
}
