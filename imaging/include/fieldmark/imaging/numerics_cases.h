#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::imaging {

/// The hard cases of the room's ops, norms, sums and optimiser, each with the error that it may have.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::imaging
