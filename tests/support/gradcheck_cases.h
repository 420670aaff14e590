#pragma once
#include <fieldmark/engine/gradcheck_cases.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/source_dir.h"

/// Checks that every case of a module has a unique name and passes with a relative error of at most `worst`.
inline void expect_cases_pass(const std::vector<fieldmark::GradcheckCase>& cases,
                              double worst = std::numeric_limits<double>::infinity()) {
  REQUIRE_FALSE(cases.empty());
  std::set<std::string> names;
  for (const auto& c : cases) {
    const fieldmark::GradcheckReport r = c.run();
    INFO(c.name << ": worst relative error " << r.worst << "\n" << r.table);
    CHECK(r.ok);
    CHECK(r.worst <= worst);
    CHECK(r.entries > 0);
    CHECK(names.insert(c.name).second);
  }
}

/// True if a case's name begins with a word: no letter, digit or underscore follows it.
inline bool begins_with_word(const std::string& name, const std::string& word) {
  if (!name.starts_with(word)) return false;
  const char next = name.c_str()[word.size()];
  return next != '_' && std::isalnum(static_cast<unsigned char>(next)) == 0;
}

/// Checks that each header below a source folder that documents its differentiability has a case whose name
/// begins with the header's word. @return the number of such headers
inline int expect_case_of_each_header(const std::vector<fieldmark::GradcheckCase>& cases,
                                      const std::string& folder) {
  int found = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(source_dir() + "/" + folder)) {
    if (file.path().extension() != ".h") continue;
    std::ostringstream text;
    text << std::ifstream(file.path()).rdbuf();
    if (text.str().find("Differentiable in:") == std::string::npos) continue;
    ++found;
    const std::string stem = file.path().stem().string();
    INFO("no gradcheck case begins with the word " << stem << " (" << file.path().string() << ")");
    CHECK(std::any_of(cases.begin(), cases.end(),
                      [&](const auto& c) { return begins_with_word(c.name, stem); }));
  }
  return found;
}
