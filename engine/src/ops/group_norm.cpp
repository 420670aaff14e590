#include <fieldmark/engine/ops/group_norm.h>

#include "ops/normalisation.h"

namespace fieldmark {

template <class T>
Var<T> group_norm(Var<T> x, Var<T> gamma, Var<T> beta, const GroupNormOptions& options) {
  kernels::check_norm("group_norm", x, gamma, beta, options.eps);
  const Shape s = x.shape();
  if (options.groups < 1 || s[3] % options.groups != 0)
    throw ValueError("[group_norm] groups must divide the " + std::to_string(s[3]) + " channels of x, got " +
                     std::to_string(options.groups));
  const kernels::NormLayout layout{s[0], s[1] * s[2], s[3], options.groups};
  auto* mean = x.tape().template scratch<double>(s[0] * options.groups);
  auto* variance = x.tape().template scratch<double>(s[0] * options.groups);
  kernels::group_statistics(x.tape(), layout, x.value(), mean, variance);
  // The backward is derived in ops/normalisation.h.
  return kernels::apply_norm(layout, x, gamma, beta, mean, variance, options.eps, options.relu, false);
}

template Var<float> group_norm(Var<float>, Var<float>, Var<float>, const GroupNormOptions&);
template Var<double> group_norm(Var<double>, Var<double>, Var<double>, const GroupNormOptions&);

}  // namespace fieldmark
