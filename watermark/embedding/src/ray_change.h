#pragma once
#include <fieldmark/engine/shape.h>

#include <cstdint>
#include <span>

namespace fieldmark::watermark {

/// Calls f(ray, channel, sum) with the difference of colours that each ray shows, sum_i w_i (a_i - b_i) over
/// its samples.
/// @param begin  [rays + 1] of each ray's samples, and the end   @param weight  [samples]
/// @param a  [samples, 3]   @param b  [samples, 3]
template <class F>
void for_each_ray_change(std::span<const std::int32_t> begin, std::span<const float> weight, const float* a,
                         const float* b, F f) {
  for (std::size_t r = 0; r + 1 < begin.size(); ++r)
    for (Index channel = 0; channel < 3; ++channel) {
      double sum = 0;
      for (Index i = begin[r]; i < begin[r + 1]; ++i)
        sum += static_cast<double>(weight[at(i)] * (a[3 * i + channel] - b[3 * i + channel]));
      f(r, static_cast<std::size_t>(channel), sum);
    }
}

/// Returns the sum over rays and channels of the squared differences that rays show.
inline double power_on_rays(std::span<const std::int32_t> begin, std::span<const float> weight,
                            const float* a, const float* b) {
  double power = 0;
  for_each_ray_change(begin, weight, a, b, [&](std::size_t, std::size_t, double sum) { power += sum * sum; });
  return power;
}

/// Writes the differences that rays show. @param change  [rays, 3]
inline void change_on_rays(std::span<const std::int32_t> begin, std::span<const float> weight, const float* a,
                           const float* b, float* change) {
  for_each_ray_change(begin, weight, a, b, [&](std::size_t ray, std::size_t channel, double sum) {
    change[3 * ray + channel] = static_cast<float>(sum);
  });
}

}  // namespace fieldmark::watermark
