#pragma once
#include <string>

/// The folder of the sources that the tests were built from.
std::string source_dir();
