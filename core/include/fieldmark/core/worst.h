#pragma once
#include <cmath>

namespace fieldmark {

/// Raises `worst` to `error` if that is larger. NaN is sticky, so a later comparison with a limit fails;
/// std::max would drop it, because every comparison with NaN is false.
inline void raise_to(double& worst, double error) {
  if (!(error <= worst) && !std::isnan(worst)) worst = error;
}

}  // namespace fieldmark
