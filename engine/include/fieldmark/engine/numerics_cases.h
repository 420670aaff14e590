#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark {

/// Returns the hard cases of the engine's ops, norms, sums and optimiser, each with its error limit.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark
