#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark::imaging {

/// Returns the gradient checks of every differentiable op and module in this room.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark::imaging
