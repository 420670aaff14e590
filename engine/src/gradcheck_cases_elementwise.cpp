#include <fieldmark/engine/ops/softmax.h>

#include "gradcheck_cases_parts.h"

namespace fieldmark {
namespace {

GradcheckReport check_softmax() {
  const std::vector<Tensor<double>> inputs{{Shape{2, 3}, {0.5, -1, 2, 3, 3.5, 2}}};
  return gradcheck([](Tape<double>&, auto v) { return softmax(v[0]); }, inputs);
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases_elementwise() { return {{"softmax", check_softmax}}; }

}  // namespace fieldmark
