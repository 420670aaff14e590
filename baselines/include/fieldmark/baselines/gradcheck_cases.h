#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark::baselines {

/// Every differentiable op and network of this module, in its inputs and its parameters. Names begin with the
/// unit's stem. Networks are checked in their smallest form, every parameter by itself.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark::baselines
