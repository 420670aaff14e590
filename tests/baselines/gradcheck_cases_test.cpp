#include <fieldmark/baselines/gradcheck_cases.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("gradcheck_cases: every case of the module passes") {
  for (const GradcheckCase& c : baselines::gradcheck_cases()) {
    const GradcheckReport r = c.run();
    INFO(c.name << ": worst relative error " << r.worst << "\n" << r.table);
    CHECK(r.ok);
    CHECK(r.entries > 0);
  }
}

TEST_CASE("gradcheck_cases: every header that promises a gradient has a case") {
  const auto cases = baselines::gradcheck_cases();
  int promised = 0;
  const std::filesystem::path root = FIELDMARK_SOURCE_DIR "/baselines/include/fieldmark/baselines";
  for (const auto& file : std::filesystem::recursive_directory_iterator(root)) {
    std::ifstream in(file.path());
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (text.find("Differentiable in:") == std::string::npos) continue;
    ++promised;
    const std::string stem = file.path().stem().string();
    INFO(stem);
    CHECK(std::any_of(cases.begin(), cases.end(), [&](const auto& c) { return c.name.rfind(stem, 0) == 0; }));
  }
  CHECK(promised == 6);
}
