#include "kernels/frequency.h"

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

constexpr int kBlock = 64;

// Computes sin(pi r) and cos(pi r) for r in [-1/4, 1/4] by Taylor series, whose first omitted terms are below
// 2e-17 and 3e-16 of the values (in double; the float series stop at float precision).
[[gnu::always_inline]] inline void series(float r, float& s, float& c) {
  const float u = r * r;
  s = r * (3.14159265f + u * (-5.16771278f + u * (2.55016404f + u * (-0.599264529f + u * 0.0821458866f))));
  c = 1 +
      u * (-4.93480220f + u * (4.05871213f + u * (-1.33526277f + u * (0.235330630f + u * -0.0258068914f))));
}
[[gnu::always_inline]] inline void series(double r, double& s, double& c) {
  const double u = r * r;
  s = r * (3.14159265358979324 +
           u * (-5.16771278004997003 +
                u * (2.55016403987734544 +
                     u * (-0.599264529320792077 +
                          u * (0.0821458866111282288 +
                               u * (-7.37043094571435077e-3 +
                                    u * (4.66302805767612567e-4 +
                                         u * (-2.19153534478302166e-5 + u * 7.95205400147551e-7))))))));
  c = 1 + u * (-4.93480220054467931 +
               u * (4.05871212641676822 +
                    u * (-1.33526276885458943 +
                         u * (0.235330630358893205 +
                              u * (-0.0258068913900140607 +
                                   u * (1.92957430940392305e-3 +
                                        u * (-1.04638104924845849e-4 + u * 4.30306958703294e-6)))))));
}

// Scaling by 2^b and the reduction modulo 2 are exact, however far x is from the origin.
template <class T>
void forward(const T* x, std::int64_t n, int dims, int bands, T* y) {
  T p[kBlock], s[kBlock], c[kBlock];
  const std::int64_t row = 2 * bands * dims;
  for (std::int64_t begin = 0; begin < n; begin += kBlock) {
    const int count = static_cast<int>(n - begin < kBlock ? n - begin : kBlock);
    for (int a = 0; a < dims; ++a) {
      for (int i = 0; i < kBlock; ++i) p[i] = x[(begin + (i < count ? i : 0)) * dims + a];
      T scale = 1;
      for (int b = 0; b < bands; ++b, scale *= 2) {
        for (int i = 0; i < kBlock; ++i) {
          const T v = p[i] * scale;
          const T turn = v - 2 * __builtin_floor(v * T(0.5));    // [0, 2)
          const T quarter = __builtin_floor(2 * turn + T(0.5));  // nearest multiple of 1/2: 0 .. 4
          T sr, cr;
          series(turn - T(0.5) * quarter, sr, cr);
          const int q = static_cast<int>(quarter) & 3;
          const T sv = (q & 1) ? cr : sr, cv = (q & 1) ? sr : cr;
          s[i] = (q & 2) ? -sv : sv;
          c[i] = (q == 1 || q == 2) ? -cv : cv;
        }
        for (int i = 0; i < count; ++i) {
          y[(begin + i) * row + 2 * b * dims + a] = s[i];
          y[(begin + i) * row + (2 * b + 1) * dims + a] = c[i];
        }
      }
    }
  }
}

}  // namespace

template <class T>
void frequency_forward(const T* x, std::int64_t n, int dims, int bands, T* y) {
  forward(x, n, dims, bands, y);
}

template void frequency_forward(const float*, std::int64_t, int, int, float*);
template void frequency_forward(const double*, std::int64_t, int, int, double*);

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
