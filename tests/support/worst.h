#pragma once
#include <cmath>

/// Raises `worst` to `error` if that is larger; a NaN stays, so that a comparison with a limit fails.
inline void raise_to(double& worst, double error) {
  if (!(error <= worst) && !std::isnan(worst)) worst = error;
}
