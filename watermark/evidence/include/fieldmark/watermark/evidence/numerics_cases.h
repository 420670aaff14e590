#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::watermark {

/// Returns hard cases of p-values, weighted segments and residual budgets, each with its error bound.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::watermark
