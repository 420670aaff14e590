#pragma once
#include <string>

/// Returns the source folder that the tests were built from.
std::string source_dir();
