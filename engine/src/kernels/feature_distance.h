#pragma once
#include <fieldmark/engine/kernel.h>

namespace fieldmark::kernels {

template <class T>
struct FeaturePair {
  const T* a = nullptr;  ///< [pixels, channels]
  const T* b = nullptr;  ///< [pixels, channels]
  const T* w = nullptr;  ///< [channels]
  Index pixels = 0, channels = 0;
};

// T is float or double. The sum over pixels of sum_c w_c (a_c / (|a| + 1e-10) - b_c / (|b| + 1e-10))^2.
FIELDMARK_DECLARE_KERNEL(template <class T> double, feature_distance, (const FeaturePair<T>& p))
// da = or += `share` times the gradient of that sum in a. Swap a and b for the gradient in b.
FIELDMARK_DECLARE_KERNEL(template <class T> void, feature_distance_backward,
                         (const FeaturePair<T>& p, T share, bool add, T* da))

}  // namespace fieldmark::kernels
