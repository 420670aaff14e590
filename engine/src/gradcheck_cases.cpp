#include <fieldmark/engine/gradcheck_cases.h>

#include "gradcheck_cases_parts.h"

namespace fieldmark {

std::vector<GradcheckCase> gradcheck_cases() {
  std::vector<GradcheckCase> all = gradcheck_cases_elementwise();
  for (GradcheckCase& c : gradcheck_cases_linear()) all.push_back(std::move(c));
  return all;
}

}  // namespace fieldmark
