#include <fieldmark/engine/kernel.h>

#include "support/each_isa.h"

namespace {
namespace isa_v2 {
int level() { return 2; }
}  // namespace isa_v2
namespace isa_v3 {
int level() { return 3; }
}  // namespace isa_v3
namespace isa_v4 {
int level() { return 4; }
}  // namespace isa_v4
}  // namespace

TEST_CASE("kernel: the one of the level in use is picked") {
  int calls = 0;
  each_isa([&] {
    CHECK(FIELDMARK_KERNEL(level)() == static_cast<int>(fieldmark::isa()));
    ++calls;
  });
  CHECK(calls > 0);
}
