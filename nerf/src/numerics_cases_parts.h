#pragma once
#include <fieldmark/engine/numerics.h>

namespace fieldmark::nerf {

// The parts that numerics_cases() is assembled from.
void add_composite_numerics(std::vector<NumericsCase>& cases);
void add_importance_numerics(std::vector<NumericsCase>& cases);
void add_space_numerics(std::vector<NumericsCase>& cases);

}  // namespace fieldmark::nerf
