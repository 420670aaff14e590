#pragma once
#include <cstdlib>
#include <iostream>
#include <string>

/// Whether Debian's interpreter has PyTorch. Where it has not, says so in the words that tools/test counts,
/// and the test is to return.
inline bool torch_or_skip(const std::string& what) {
  if (std::system("/usr/bin/python3 -c 'import torch, numpy' >/dev/null 2>&1") == 0) return true;
  std::cout << "SKIPPED: " << what << " needs python3-torch\n";
  return false;
}
