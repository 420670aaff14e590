#include <fieldmark/core/error.h>
#include <fieldmark/engine/isa.h>

#include <iostream>
#include <string>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("isa: a scope's level ends with it, also by an exception") {
  const Isa before = isa();
  CHECK_THROWS_AS(
      [] {
        const ScopedIsa scope(Isa::v2);
        CHECK(isa() == Isa::v2);
        throw ValueError("out");
      }(),
      ValueError);
  CHECK(isa() == before);
}

TEST_CASE("isa: every level up to the CPU's can be forced, none above") {
  const ScopedIsa before(isa());
  for (Isa level : {Isa::v2, Isa::v3, Isa::v4}) {
    if (level <= isa_supported()) {
      force_isa(level);
      CHECK(isa() == level);
      CHECK(std::string(isa_name()) == "v" + std::to_string(static_cast<int>(level)));
    } else {
      CHECK_THROWS_WITH(force_isa(level), Contains("this CPU has at most"));
      std::cout << "SKIPPED: checks on x86-64-v" << static_cast<int>(level) << " needs a CPU that has it\n";
    }
  }
}
