#pragma once
#include <cstdlib>
#include <iostream>
#include <string>

/// True if Debian's Python has PyTorch. If not, prints the message that tools/test counts; the test must then
/// return. Looks for the packages alone: to import PyTorch takes seconds, and the test does so itself.
inline bool torch_or_skip(const std::string& what) {
  const char* const has_both =
      "/usr/bin/python3 -c 'from importlib.util import find_spec as has; "
      "exit(not (has(\"torch\") and has(\"numpy\")))' >/dev/null 2>&1";
  if (std::system(has_both) == 0) return true;
  std::cout << "SKIPPED: " << what << " needs python3-torch\n";
  return false;
}
