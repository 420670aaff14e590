#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::distort {

/// Identities, permutations of pixels and blur, each with its error limit.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::distort
