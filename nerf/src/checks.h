#pragma once
// Checks and conversions that many sources of this library need.
#include <fieldmark/engine/shape_checks.h>

#include <string>
#include <string_view>

namespace fieldmark::nerf {

/// @throws ValueError "[op] name must be least to most, got value" unless value is in that range
inline void check_range(std::string_view op, std::string_view name, Index value, Index least, Index most) {
  if (value < least || value > most)
    throw ValueError("[" + std::string(op) + "] " + std::string(name) + " must be " + std::to_string(least) +
                     " to " + std::to_string(most) + ", got " + std::to_string(value));
}

}  // namespace fieldmark::nerf
