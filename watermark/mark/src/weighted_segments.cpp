#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include <algorithm>

namespace fieldmark::watermark {

template <class T>
Var<T> weighted_segments(Var<T> x, std::span<const std::int32_t> begin,
                         std::span<const std::type_identity_t<T>> weights) {
  check_rank("weighted_segments", "x", x.shape(), 2, "[S, C]");
  const Index samples = x.shape()[0], channels = x.shape()[1];
  if (static_cast<Index>(weights.size()) != samples)
    throw ShapeError("[weighted_segments] weights must have one number a row of x (" +
                     std::to_string(samples) + "), got " + std::to_string(weights.size()));
  if (begin.empty() || begin.front() != 0 || begin.back() != samples ||
      !std::is_sorted(begin.begin(), begin.end()))
    throw ValueError("[weighted_segments] begin must rise from 0 to the rows of x, " +
                     std::to_string(samples));
  const Index segments = static_cast<Index>(begin.size()) - 1;
  T* y = nullptr;
  const Var<T> out = x.tape().output({segments, channels}, &y, {x});
  const std::int32_t* first = begin.data();
  const T* w = weights.data();
  std::fill_n(y, segments * channels, T(0));
  for (Index p = 0; p < segments; ++p)
    for (Index k = first[p]; k < first[p + 1]; ++k)
      for (Index c = 0; c < channels; ++c) y[p * channels + c] += w[k] * x.value()[k * channels + c];

  // dx[k, :] = weights[k] dy[p(k), :].
  x.tape().on_backward(out, [x, first, w, segments, channels](const T* dy) {
    T* dx = x.grad_acc();
    for (Index p = 0; p < segments; ++p)
      for (Index k = first[p]; k < first[p + 1]; ++k)
        for (Index c = 0; c < channels; ++c) dx[k * channels + c] += w[k] * dy[p * channels + c];
  });
  return out;
}

template Var<float> weighted_segments(Var<float>, std::span<const std::int32_t>, std::span<const float>);
template Var<double> weighted_segments(Var<double>, std::span<const std::int32_t>, std::span<const double>);

}  // namespace fieldmark::watermark
