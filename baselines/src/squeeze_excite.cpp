#include "squeeze_excite.h"
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <string>

namespace fieldmark::baselines {
namespace {
constexpr Index kReduction = 8;

Index squeezed(Index channels) { return std::max<Index>(1, channels / kReduction); }
}  // namespace

template <class T>
Var<T> scale_channels(Var<T> x, Var<T> s) {
  check_rank("scale_channels", "x", x.shape(), 4, "[images, height, width, channels]");
  check_rank("scale_channels", "s", s.shape(), 2, "[images, channels]");
  check_extent("scale_channels", "s", s.shape(), 0, x.shape()[0], "images of x");
  check_extent("scale_channels", "s", s.shape(), 1, x.shape()[3], "channels of x");
  const Index n = x.shape()[0], pixels = x.shape()[1] * x.shape()[2], channels = x.shape()[3];
  T* y = nullptr;
  const Var<T> out = x.tape().output(x.shape(), &y, {x, s});
  parallel_for(n, 1, [&](Index begin, Index end) {
    for (Index p = begin * pixels; p < end * pixels; ++p)
      for (Index c = 0; c < channels; ++c)
        y[p * channels + c] = x.value()[p * channels + c] * s.value()[p / pixels * channels + c];
  });

  // dx = dy s, ds = sum over pixels of dy x, in double. A chunk owns its images of dx and rows of ds.
  x.tape().on_backward(out, [=](const T* dy) {
    T* dx = x.grad_acc();
    T* ds = s.grad_acc();
    parallel_for(n, 1, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i)
        for (Index c = 0; c < channels; ++c) {
          double sum = 0;
          for (Index p = i * pixels; p < (i + 1) * pixels; ++p) {
            const Index k = p * channels + c;
            if (dx) dx[k] += dy[k] * s.value()[i * channels + c];
            sum += static_cast<double>(dy[k]) * static_cast<double>(x.value()[k]);
          }
          if (ds) ds[i * channels + c] += static_cast<T>(sum);
        }
    });
  });
  return out;
}

template <class T>
SqueezeExciteBlock<T>::SqueezeExciteBlock(ParamStore<T>& store, std::string_view name, Index channels,
                                          std::uint64_t seed)
    : first_(store, std::string(name) + "/0", channels, channels, seed),
      second_(store, std::string(name) + "/1", channels, channels, seed + 1, false),
      squeeze_(store, std::string(name) + "/squeeze",
               DenseOptions{.in = channels, .out = squeezed(channels), .activation = Activation::relu},
               seed + 2),
      excite_(store, std::string(name) + "/excite", DenseOptions{.in = squeezed(channels), .out = channels},
              seed + 3) {}

template <class T>
Var<T> SqueezeExciteBlock<T>::operator()(const Params<T>& params, Var<T> x, NormPass<T>& pass) const {
  const Var<T> b = second_(params, first_(params, x, pass), pass);
  const Var<T> weight = sigmoid(excite_(params, squeeze_(params, global_avg_pool(b))));
  return relu(add(x, scale_channels(b, weight)));
}

template Var<float> scale_channels(Var<float>, Var<float>);
template Var<double> scale_channels(Var<double>, Var<double>);
template class SqueezeExciteBlock<float>;
template class SqueezeExciteBlock<double>;

}  // namespace fieldmark::baselines
