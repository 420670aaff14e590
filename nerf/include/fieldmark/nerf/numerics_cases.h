#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::nerf {

/// The hard cases of quadrature, encodings and ray marching, each with the error that it may have.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::nerf
