#pragma once
#include <fieldmark/engine/numerics.h>

namespace fieldmark {

// The parts that numerics_cases() is assembled from.
void add_elementwise_numerics(std::vector<NumericsCase>& cases);
void add_matrix_numerics(std::vector<NumericsCase>& cases);
void add_norm_numerics(std::vector<NumericsCase>& cases);
void add_sum_numerics(std::vector<NumericsCase>& cases);
void add_tensor_numerics(std::vector<NumericsCase>& cases);

// Raises a magnitude to at least the smallest normal number, below which rounding is absolute.
template <class T>
long double size_of(long double exact) {
  return std::max(std::abs(exact), static_cast<long double>(std::numeric_limits<T>::min()));
}

}  // namespace fieldmark
