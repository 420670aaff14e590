#include "gradcheck_cases_parts.h"

namespace fieldmark {

std::vector<GradcheckCase> gradcheck_cases_linear() { return {}; }

}  // namespace fieldmark
