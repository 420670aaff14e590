// A custom op with its gradient, checked against finite differences. Public headers only.
#include <fieldmark/engine/gradcheck.h>
#include <fieldmark/engine/parallel.h>

#include <cmath>
#include <cstdio>

using namespace fieldmark;

namespace {

// Applies Swish (Ramachandran et al. 2017) to every element: y = x / (1 + exp(-x)).
template <class T>
Var<T> swish(Var<T> x) {
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x});  // memory on the tape; needs a gradient if x does
  const Index n = x.shape().size();
  const T* in = x.value();
  constexpr Index kGrain = 1 << 14;  // chunks do not depend on the thread count, so neither do the bits
  parallel_for(n, kGrain, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) y[i] = in[i] / (1 + std::exp(-in[i]));
  });

  // With s = 1 / (1 + exp(-x)):   dx = dy (s + x s (1 - s)). A chunk owns its elements. Backward accumulates,
  // because other ops may read x too.
  x.tape().on_backward(out, [=](const T* dy) {
    T* dx = x.grad_acc();
    parallel_for(n, kGrain, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        const T s = 1 / (1 + std::exp(-in[i]));
        dx[i] += dy[i] * (s + in[i] * s * (1 - s));
      }
    });
  });
  return out;
}

}  // namespace

int main() {
  const Tensor<double> x({2, 4}, {-20, -2, -0.5, 0, 1e-3, 0.7, 3, 30});
  const GradcheckReport report = gradcheck(
      [](Tape<double>&, std::span<const Var<double>> in) { return swish(in[0]); }, std::span(&x, 1));
  std::printf("swish: %lld gradients, worst relative error %.1e: %s\n%s",
              static_cast<long long>(report.entries), report.worst, report.ok ? "ok" : "FAILED",
              report.table.c_str());
  Tape<float> tape;
  const Tensor<float> one({1}, 1);
  const float got = swish(tape.constant(one)).value()[0];
  return report.ok && std::abs(got - 0.7310586f) < 1e-6f ? 0 : 1;
}
