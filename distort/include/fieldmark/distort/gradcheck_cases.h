#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark::distort {

/// Returns gradient checks of every differentiable op of this module, for the image and the parameters. Names
/// begin with the stem of the unit.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark::distort
