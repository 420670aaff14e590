#pragma once
#include <fieldmark/engine/gradcheck.h>

#include <vector>

namespace fieldmark {

std::vector<GradcheckCase> gradcheck_cases_elementwise();
std::vector<GradcheckCase> gradcheck_cases_linear();

}  // namespace fieldmark
