#include <fieldmark/engine/gradcheck_cases.h>

#include <set>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("gradcheck_cases: every case of the engine passes, under a name of its own") {
  std::set<std::string> names;
  for (const GradcheckCase& c : gradcheck_cases()) {
    const GradcheckReport r = c.run();
    INFO(c.name << ": worst relative error " << r.worst << "\n" << r.table);
    CHECK(r.ok);
    CHECK(r.entries > 0);
    CHECK(names.insert(c.name).second);
  }
  CHECK(!names.empty());
}
