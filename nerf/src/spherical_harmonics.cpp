#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/spherical_harmonics.h>

#include <algorithm>

namespace fieldmark::nerf {
namespace {

constexpr Index kDirectionGrain = 4096;
// Normalisation constants: sqrt(1 / 4 pi), sqrt(3 / 4 pi), sqrt(15 / 4 pi), sqrt(5 / 16 pi), sqrt(15 / 16
// pi), sqrt(35 / 32 pi), sqrt(105 / 4 pi), sqrt(21 / 32 pi), sqrt(7 / 16 pi), sqrt(105 / 16 pi).
constexpr double k0 = 0.28209479177387814, k1 = 0.48860251190291992, k2a = 1.0925484305920792,
                 k2b = 0.31539156525252005, k2c = 0.54627421529603959, k3a = 0.59004358992664352,
                 k3b = 2.8906114426405538, k3c = 0.45704579946446577, k3d = 0.3731763325901154,
                 k3e = 1.4453057213202769;

template <class T>
void values(T x, T y, T z, T* out) {
  const T v[] = {T(k0),
                 T(-k1) * y,
                 T(k1) * z,
                 T(-k1) * x,
                 T(k2a) * x * y,
                 T(-k2a) * y * z,
                 T(k2b) * (3 * z * z - 1),
                 T(-k2a) * x * z,
                 T(k2c) * (x * x - y * y),
                 T(k3a) * y * (y * y - 3 * x * x),
                 T(k3b) * x * y * z,
                 T(k3c) * y * (1 - 5 * z * z),
                 T(k3d) * z * (5 * z * z - 3),
                 T(k3c) * x * (1 - 5 * z * z),
                 T(k3e) * z * (x * x - y * y),
                 T(k3a) * x * (3 * y * y - x * x)};
  std::copy_n(v, kSphericalHarmonics, out);
}

// d[i][a] = d value_i / d axis_a.
template <class T>
void derivatives(T x, T y, T z, T (*d)[3]) {
  const T v[][3] = {{0, 0, 0},
                    {0, T(-k1), 0},
                    {0, 0, T(k1)},
                    {T(-k1), 0, 0},
                    {T(k2a) * y, T(k2a) * x, 0},
                    {0, T(-k2a) * z, T(-k2a) * y},
                    {0, 0, T(6 * k2b) * z},
                    {T(-k2a) * z, 0, T(-k2a) * x},
                    {T(2 * k2c) * x, T(-2 * k2c) * y, 0},
                    {T(-6 * k3a) * x * y, T(3 * k3a) * (y * y - x * x), 0},
                    {T(k3b) * y * z, T(k3b) * x * z, T(k3b) * x * y},
                    {0, T(k3c) * (1 - 5 * z * z), T(-10 * k3c) * y * z},
                    {0, 0, T(3 * k3d) * (5 * z * z - 1)},
                    {T(k3c) * (1 - 5 * z * z), 0, T(-10 * k3c) * x * z},
                    {T(2 * k3e) * x * z, T(-2 * k3e) * y * z, T(k3e) * (x * x - y * y)},
                    {T(3 * k3a) * (y * y - x * x), T(6 * k3a) * x * y, 0}};
  std::copy_n(&v[0][0], 3 * kSphericalHarmonics, &d[0][0]);
}

}  // namespace

template <class T>
Var<T> spherical_harmonics(Var<T> d) {
  check_rank("spherical_harmonics", "d", d.shape(), 2, "[N, 3]");
  check_extent("spherical_harmonics", "d", d.shape(), 1, 3, "x, y, z");
  const Index n = d.shape()[0];
  T* y = nullptr;
  const Var<T> out = d.tape().output({n, kSphericalHarmonics}, &y, {d});
  parallel_for(n, kDirectionGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const T* p = d.value() + 3 * i;
      values(p[0], p[1], p[2], y + i * kSphericalHarmonics);
    }
  });

  // dd_a = sum_i dy_i dY_i/da. A direction owns its row of dd.
  d.tape().on_backward(out, [d, n](const T* dy) {
    T* dd = d.grad_acc();
    parallel_for(n, kDirectionGrain, [&](Index begin, Index end) {
      T grad[kSphericalHarmonics][3];
      for (Index i = begin; i < end; ++i) {
        const T* p = d.value() + 3 * i;
        derivatives(p[0], p[1], p[2], grad);
        for (int a = 0; a < 3; ++a)
          for (Index k = 0; k < kSphericalHarmonics; ++k)
            dd[3 * i + a] += dy[i * kSphericalHarmonics + k] * grad[k][a];
      }
    });
  });
  return out;
}

template Var<float> spherical_harmonics(Var<float>);
template Var<double> spherical_harmonics(Var<double>);

}  // namespace fieldmark::nerf
