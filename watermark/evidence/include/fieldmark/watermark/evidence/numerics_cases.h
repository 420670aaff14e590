#pragma once
#include <fieldmark/engine/numerics.h>

#include <vector>

namespace fieldmark::watermark {

/// p-values down to the least numbers, pixels in long segments and residuals near 0, each with the error that
/// it may have.
std::vector<NumericsCase> numerics_cases();

}  // namespace fieldmark::watermark
