#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark::nerf {

/// Returns the gradient checks of every differentiable op and module of this library, in alphabetical order.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark::nerf
