#include <fieldmark/imaging/metrics.h>
#include <fieldmark/imaging/numerics_cases.h>

namespace fieldmark::imaging {
namespace {

using Real = long double;

// SSIM of images without variance is (2 a b + c1) / (a^2 + b^2 + c1), which tests for cancellation.
void compare_ssim(WorstError& error) {
  constexpr Real c1 = 1e-4L;
  for (const float a : {0.f, 0.1f, 1.f})
    for (const float b : {0.f, 0.1f, 0.7f, 1.f}) {
      const Tensor<float> p({24, 20, 3}, a), q({24, 20, 3}, b);
      const Real want = (2 * Real{a} * b + c1) / (Real{a} * a + Real{b} * b + c1);
      error.compare(ssim(p, q), want, 1);
    }
}

}  // namespace

std::vector<NumericsCase> numerics_cases() {
  return {{"metrics: ssim of constant images", "float", "1", 1e-12, [] {
             WorstError e;
             compare_ssim(e);
             return e;
           }}};
}

}  // namespace fieldmark::imaging
