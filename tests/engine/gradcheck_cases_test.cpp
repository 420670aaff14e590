#include <fieldmark/engine/gradcheck_cases.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("gradcheck_cases: every case of the engine passes, under a name of its own") {
  std::set<std::string> names;
  for (const GradcheckCase& c : gradcheck_cases()) {
    const GradcheckReport r = c.run();
    INFO(c.name << ": worst relative error " << r.worst << "\n" << r.table);
    CHECK(r.ok);
    CHECK(r.worst <= 1e-7);
    CHECK(r.entries > 0);
    CHECK(names.insert(c.name).second);
  }
}

TEST_CASE("gradcheck_cases: every header that is differentiable in something has a case") {
  const auto cases = gradcheck_cases();
  int found = 0;
  for (const auto& file :
       std::filesystem::recursive_directory_iterator(FIELDMARK_SOURCE_DIR "/engine/include")) {
    if (file.path().extension() != ".h") continue;
    std::ostringstream text;
    text << std::ifstream(file.path()).rdbuf();
    if (text.str().find("Differentiable in:") == std::string::npos) continue;
    ++found;
    const std::string stem = file.path().stem().string();
    INFO("no gradcheck case begins with " << stem << " (" << file.path().string() << ")");
    CHECK(std::any_of(cases.begin(), cases.end(), [&](const auto& c) { return c.name.starts_with(stem); }));
  }
  CHECK(found >= 13);
}
