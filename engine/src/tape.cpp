#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tape.h>

namespace fieldmark::detail {

template <class T>
void seed_gradient(const T* seed, const T* mask, bool fresh, T* g, Index n) {
  parallel_for(n, Index{1} << 15, [=](Index begin, Index end) {
    if (!fresh)
      for (Index i = begin; i < end; ++i) g[i] += seed[i];
    else if (!mask)
      std::copy(seed + begin, seed + end, g + begin);
    else
      for (Index i = begin; i < end; ++i) {
        const T s = seed[i];
        g[i] = mask[i] > 0 ? s : T(0);
      }
  });
}

template void seed_gradient(const float*, const float*, bool, float*, Index);
template void seed_gradient(const double*, const double*, bool, double*, Index);

}  // namespace fieldmark::detail
