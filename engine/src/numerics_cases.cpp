#include <fieldmark/engine/numerics_cases.h>

#include "numerics_cases_parts.h"

namespace fieldmark {

std::vector<NumericsCase> numerics_cases() {
  std::vector<NumericsCase> all;
  add_elementwise_numerics(all);
  add_matrix_numerics(all);
  add_norm_numerics(all);
  add_sum_numerics(all);
  add_tensor_numerics(all);
  return all;
}

}  // namespace fieldmark
