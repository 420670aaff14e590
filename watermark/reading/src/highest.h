#pragma once
// The greatest of a few values that take long to compute. Private.
#include <cstddef>

namespace fieldmark::watermark {

/// Returns where a function is greatest on [0, count), the first of equal values: looks at every second
/// number, then beside the best. That is exact for one maximum; of several narrow ones, it may return
/// another.
/// @param count  at least 1   @param value  called about count / 2 + 2 times
template <class F>
std::size_t highest(std::size_t count, const F& value) {
  std::size_t second = 0;
  double most = value(second);
  for (std::size_t i = 2; i < count; i += 2)
    if (const double next = value(i); next > most) most = next, second = i;
  std::size_t top = second;
  if (second > 0)
    if (const double next = value(second - 1); next >= most) most = next, top = second - 1;
  if (second + 1 < count && value(second + 1) > most) top = second + 1;
  return top;
}

}  // namespace fieldmark::watermark
