#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::imaging {

/// Returns the hard numerical cases of the metrics, each with its error limit.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::imaging
