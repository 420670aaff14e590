#include <fieldmark/extractor/gradcheck_cases.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("gradcheck_cases: every case passes") {
  for (const auto& c : extractor::gradcheck_cases()) {
    const auto report = c.run();
    INFO(c.name << ": worst relative error " << report.worst << "\n" << report.table);
    CHECK(report.ok);
    CHECK(report.entries > 0);
  }
}

TEST_CASE("gradcheck_cases: every header that is differentiable in something has a case") {
  const auto cases = extractor::gradcheck_cases();
  int found = 0;
  for (const auto& file :
       std::filesystem::directory_iterator(FIELDMARK_SOURCE_DIR "/extractor/include/fieldmark/extractor")) {
    std::ostringstream text;
    text << std::ifstream(file.path()).rdbuf();
    if (text.str().find("Differentiable in:") == std::string::npos) continue;
    ++found;
    const std::string prefix = file.path().stem().string();
    INFO("no gradcheck case begins with " << prefix);
    CHECK(std::any_of(cases.begin(), cases.end(), [&](const auto& c) { return c.name.starts_with(prefix); }));
  }
  CHECK(found == 4);
}
