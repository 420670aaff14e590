#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark::distort {

/// Every differentiable op of this module, in its image and its parameters. Names begin with the unit's stem.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark::distort
