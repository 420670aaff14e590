#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark::watermark {

/// Returns the gradient checks of every differentiable op and module here, in alphabetical order.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark::watermark
