#pragma once
#include <iostream>
#include <string>

/// Whether this build has an optional library. Where it has not, says so in the words that tools/test counts,
/// and the test is to return.
inline bool library_or_skip(bool has, const std::string& what, const std::string& package) {
  if (!has) std::cout << "SKIPPED: " << what << " needs " << package << "\n";
  return has;
}
