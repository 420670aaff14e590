#pragma once
// Checks of the options of gradient checks. Private.
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/gradcheck.h>

#include <cmath>
#include <string>

namespace fieldmark::detail {

/// Refuses what would compare nothing or let everything pass. The scale of an error is at least the rounding
/// error of the difference over rtol: at rtol 0 it is infinite and every error 0. At 1, a gradient of 0
/// passes.
/// @throws ValueError with "[function] name must be ..., got ..."
inline void check_gradcheck_options(const char* function, std::size_t inputs,
                                    const GradcheckOptions& options) {
  check_number(function, "rtol", options.rtol, options.rtol > 0 && options.rtol < 1, "above 0 and below 1");
  check_number(function, "step", options.step, options.step > 0 && std::isfinite(options.step),
               "positive and finite");
  if (inputs == 0)
    throw ValueError("[" + std::string(function) + "] inputs must be at least one tensor, got none");
}

}  // namespace fieldmark::detail
