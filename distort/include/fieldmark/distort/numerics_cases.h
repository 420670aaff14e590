#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::distort {

/// The distortions that must change nothing, or only permute pixels, and blur, each with the error that it
/// may have.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::distort
