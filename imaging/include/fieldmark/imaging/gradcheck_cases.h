#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark::imaging {

/// The gradient checks of every differentiable op and module of the room.
std::vector<GradcheckCase> gradcheck_cases();

}  // namespace fieldmark::imaging
