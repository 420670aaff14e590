#pragma once
#include <iostream>
#include <string>

/// True if this build has an optional library. If not, prints the message that tools/test counts; the test
/// must then return.
inline bool library_or_skip(bool has, const std::string& what, const std::string& package) {
  if (!has) std::cout << "SKIPPED: " << what << " needs " << package << "\n";
  return has;
}
