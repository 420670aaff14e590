#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::distort {

/// Returns numerical cases of identities, pixel permutations and blur, each with its error limit.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::distort
