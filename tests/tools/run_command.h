#pragma once
#include <sstream>
#include <string>
#include <vector>

#include "cli/cli.h"

struct Outcome {
  int code;
  std::string out, err;
};

/// Runs `fieldmark WORDS...` in this process.
inline Outcome run_command(std::vector<std::string> words) {
  words.insert(words.begin(), "fieldmark");
  std::vector<const char*> argv;
  for (const auto& word : words) argv.push_back(word.c_str());
  std::ostringstream out, err;
  const int code = fieldmark::cli::run(static_cast<int>(argv.size()), argv.data(), out, err);
  return {code, out.str(), err.str()};
}
