#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::nerf {

/// Returns hard cases of quadrature, encodings and ray marching, each with its error bound.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::nerf
