#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark::baselines {

/// Returns gradient checks of every differentiable op and network of this module, for inputs and parameters.
/// Names begin with the stem of the unit. Networks are checked in their smallest form, one parameter at a
/// time.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark::baselines
