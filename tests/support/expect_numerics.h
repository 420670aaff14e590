#pragma once
#include <fieldmark/engine/numerics.h>

#include <cstdio>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/each_isa.h"

/// Fails unless every case has a unique name and stays within its limit on each instruction set of this CPU.
inline void expect_numerics(const std::vector<fieldmark::NumericsCase>& cases) {
  REQUIRE_FALSE(cases.empty());
  std::set<std::pair<std::string, std::string>> names;
  for (const auto& c : cases) CHECK(names.insert({c.name, c.type}).second);
  each_isa([&] {
    for (const auto& c : cases) {
      const fieldmark::WorstError error = c.run();
      char figures[80];
      std::snprintf(figures, sizeof figures, "worst %.3e of %lld numbers, limit %.3e", error.worst,
                    static_cast<long long>(error.values), c.limit);
      INFO(c.name << " (" << c.type << "): " << figures << ", relative to " << c.relative_to);
      CHECK(c.ok(error));
    }
  });
}
