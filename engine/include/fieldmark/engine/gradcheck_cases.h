#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark {

/// Returns the gradient checks of every differentiable op and module of the engine.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark
