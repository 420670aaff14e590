#pragma once
#include <cstdlib>
#include <iostream>
#include <string>

/// True if Debian's Python has PyTorch. If not, prints the message that tools/test counts; the test must then
/// return.
inline bool torch_or_skip(const std::string& what) {
  if (std::system("/usr/bin/python3 -c 'import torch, numpy' >/dev/null 2>&1") == 0) return true;
  std::cout << "SKIPPED: " << what << " needs python3-torch\n";
  return false;
}
