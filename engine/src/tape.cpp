#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tape.h>

#include "kernels/gemm.h"
#include "ops/elementwise.h"

namespace fieldmark::detail {

template <class T>
void seed_gradient(const T* seed, const T* mask, bool fresh, T* g, Index n) {
  using namespace kernels;
  const auto copy_masked = FIELDMARK_KERNEL(pad_rows<T>);  // one row without padding
  parallel_for(n, Index{1} << 15, [=](Index begin, Index end) {
    const Index count = end - begin;
    if (!fresh)
      Out<T>(g + begin, count) += In<T>(seed + begin, count);
    else
      copy_masked(seed + begin, 1, count, mask ? mask + begin : nullptr, count, g + begin);
  });
}

template void seed_gradient(const float*, const float*, bool, float*, Index);
template void seed_gradient(const double*, const double*, bool, double*, Index);

}  // namespace fieldmark::detail
