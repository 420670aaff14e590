#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/frequency_encoding.h>

#include "kernels/frequency.h"

namespace fieldmark::nerf {
namespace {
constexpr Index kFrequencyGrain = 1024;  // rows per chunk
}

template <class T>
void frequency_values(const T* x, Index n, Index dims, int bands, T* y) {
  using namespace kernels;
  FIELDMARK_KERNEL(frequency_forward<T>)(x, n, static_cast<int>(dims), bands, y);
}

template <class T>
Var<T> frequency_encoding(Var<T> x, int bands) {
  check_rank("frequency_encoding", "x", x.shape(), 2, "[N, D]");
  if (x.shape()[1] < 1 || x.shape()[1] > 4)
    throw ShapeError("[frequency_encoding] x: axis 1 must be 1 to 4, got shape " + x.shape().str());
  if (bands < 1 || bands > 20)
    throw ValueError("[frequency_encoding] bands must be 1 to 20, got " + std::to_string(bands));
  const Index n = x.shape()[0], dims = x.shape()[1], row = 2 * bands * dims;
  T* y = nullptr;
  const Var<T> out = x.tape().output({n, row}, &y, {x});
  parallel_for(n, kFrequencyGrain, [&](Index begin, Index end) {
    frequency_values(x.value() + begin * dims, end - begin, dims, bands, y + begin * row);
  });

  // d sin(k x) = k cos(k x), d cos(k x) = -k sin(k x), k = 2^b pi: both are in y. A row of dx has one owner.
  x.tape().on_backward(out, [x, y, n, dims, row, bands](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(n, kFrequencyGrain, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i)
        for (Index a = 0; a < dims; ++a) {
          T sum = 0, k = static_cast<T>(3.14159265358979323846);
          for (Index b = 0; b < bands; ++b, k *= 2) {
            const Index s = i * row + 2 * b * dims + a, c = s + dims;
            sum += k * (dy[s] * y[c] - dy[c] * y[s]);
          }
          dx[i * dims + a] += sum;
        }
    });
  });
  return out;
}

template void frequency_values(const float*, Index, Index, int, float*);
template void frequency_values(const double*, Index, Index, int, double*);
template Var<float> frequency_encoding(Var<float>, int);
template Var<double> frequency_encoding(Var<double>, int);

}  // namespace fieldmark::nerf
