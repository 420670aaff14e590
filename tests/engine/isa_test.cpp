#include <fieldmark/core/error.h>
#include <fieldmark/engine/isa.h>

#include <string>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("isa: every level up to the CPU's can be forced, none above") {
  const Isa before = isa();
  for (Isa level : {Isa::v2, Isa::v3, Isa::v4}) {
    if (level <= isa_supported()) {
      force_isa(level);
      CHECK(isa() == level);
      CHECK(std::string(isa_name()) == "v" + std::to_string(static_cast<int>(level)));
    } else {
      CHECK_THROWS_WITH(force_isa(level), Contains("this CPU has at most"));
    }
  }
  force_isa(before);
}
