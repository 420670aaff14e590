#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::extractor {

/// Pools of certain and of background places, each with the error that it may have.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::extractor
