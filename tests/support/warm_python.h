#pragma once
#include <string>

#include "support/source_dir.h"

/// Returns the program that stands in for Python where a test starts many that load PyTorch, which takes
/// seconds.
inline std::string warm_python() { return source_dir() + "/tests/support/warm_python.py"; }
