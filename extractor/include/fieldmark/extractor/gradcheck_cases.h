#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark::extractor {

/// Every differentiable op and network of this module, in its inputs and its parameters. Names begin with the
/// unit's stem. Networks are checked along random directions: one for each tensor of parameters, six for the
/// image.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark::extractor
