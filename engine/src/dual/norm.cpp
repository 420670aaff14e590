#include <fieldmark/engine/dual/norm.h>
#include <fieldmark/engine/ops/math.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/reduce_axes.h>

#include <algorithm>
#include <cmath>

#include "dual/tangent.h"

namespace fieldmark {
namespace {

using detail::Tangent;
using detail::tangent_by;

// n = (x - mean) / sqrt(var + eps), mean and variance over some axes, with n' = (c - n mean(n c)) / sqrt(..),
// c = x' - mean(x').
template <class T>
Dual<T> normalised(const Dual<T>& x, const Axes& axes, double eps) {
  const auto centred = [&](Var<T> v) { return v - mean(v, axes, KeepAxes::yes); };
  const Var<T> c = centred(x.value());
  const Var<T> deviation = sqrt(affine(mean(square(c), axes, KeepAxes::yes), 1, eps)), n = c / deviation;
  return detail::with_tangent(n, x, [&](Var<T> t) {
    const Var<T> dc = centred(t);
    return (dc - n * mean(n * dc, axes, KeepAxes::yes)) / deviation;
  });
}

// Tangent of gamma n + beta.
template <class T>
Tangent<T> affine_tangent(const Dual<T>& n, const Dual<T>& gamma, const Dual<T>& beta) {
  const auto terms = detail::plus<T>(tangent_by(gamma, [&](Var<T> t) { return n.value() * t; }),
                                     tangent_by(n, [&](Var<T> t) { return gamma.value() * t; }));
  return detail::plus<T>(terms, tangent_by(beta, [](Var<T> t) { return t; }));
}

template <class T>
bool any_tangent(const Dual<T>& x, const Dual<T>& gamma, const Dual<T>& beta) {
  return x.has_tangent() || gamma.has_tangent() || beta.has_tangent();
}

}  // namespace

template <class T>
Dual<T> layer_norm(const Dual<T>& x, const Dual<T>& gamma, const Dual<T>& beta, double eps) {
  const Var<T> y = layer_norm(x.value(), gamma.value(), beta.value(), eps);
  if (!any_tangent(x, gamma, beta)) return y;
  return detail::with_tangent(y, affine_tangent(normalised(x, {-1}, eps), gamma, beta));
}

template <class T>
Dual<T> group_norm(const Dual<T>& x, const Dual<T>& gamma, const Dual<T>& beta,
                   const GroupNormOptions& options) {
  const Var<T> y = group_norm(x.value(), gamma.value(), beta.value(), options);
  if (!any_tangent(x, gamma, beta)) return y;
  const Shape& s = x.shape();
  const Index size = s[3] / options.groups;
  const auto in_groups = [&](const Dual<T>& v, Shape shape) {
    return detail::linear(v, [=](Var<T> part) { return reshape(part, shape); });
  };
  const Dual<T> n = normalised(in_groups(x, {s[0], s[1] * s[2], options.groups, size}), {1, 3}, options.eps);
  const Shape channels{options.groups, size};
  const Tangent<T> t = affine_tangent(n, in_groups(gamma, channels), in_groups(beta, channels));
  const Tangent<T> like_y = reshape(broadcast_to(*t, n.shape()), s);
  return detail::with_tangent(y, detail::rectified(options.relu, y, like_y));
}

template <class T>
Dual<T> batch_norm(const Dual<T>& x, const Dual<T>& gamma, const Dual<T>& beta,
                   const BatchNormOptions& options, BatchStatistics* statistics) {
  const Var<T> y = batch_norm(x.value(), gamma.value(), beta.value(), options, statistics);
  if (!any_tangent(x, gamma, beta)) return y;
  const auto t = affine_tangent(normalised(x, {0, 1, 2}, options.eps), gamma, beta);
  return detail::with_tangent(y, detail::rectified(options.relu, y, t));
}

template <class T>
Dual<T> batch_norm_fixed(const Dual<T>& x, const Dual<T>& gamma, const Dual<T>& beta,
                         std::span<const std::type_identity_t<T>> mean,
                         std::span<const std::type_identity_t<T>> variance, const BatchNormOptions& options) {
  const Var<T> y = batch_norm_fixed(x.value(), gamma.value(), beta.value(), mean, variance, options);
  if (!any_tangent(x, gamma, beta)) return y;
  Tape<T>& tape = x.tape();
  const Index channels = static_cast<Index>(mean.size());
  T *means = tape.scratch(channels), *deviations = tape.scratch(channels);
  for (std::size_t c = 0; c < mean.size(); ++c) {
    means[c] = mean[c];
    deviations[c] = static_cast<T>(std::sqrt(static_cast<double>(variance[c]) + options.eps));
  }
  const Var<T> m = tape.constant(means, {channels}), d = tape.constant(deviations, {channels});
  const Dual<T> n = detail::with_tangent((x.value() - m) / d, x, [=](Var<T> t) { return t / d; });
  return detail::with_tangent(y, detail::rectified(options.relu, y, affine_tangent(n, gamma, beta)));
}

#define FIELDMARK_DUAL_NORM(T)                                                                          \
  template Dual<T> layer_norm(const Dual<T>&, const Dual<T>&, const Dual<T>&, double);                  \
  template Dual<T> group_norm(const Dual<T>&, const Dual<T>&, const Dual<T>&, const GroupNormOptions&); \
  template Dual<T> batch_norm(const Dual<T>&, const Dual<T>&, const Dual<T>&, const BatchNormOptions&,  \
                              BatchStatistics*);                                                        \
  template Dual<T> batch_norm_fixed(const Dual<T>&, const Dual<T>&, const Dual<T>&, std::span<const T>, \
                                    std::span<const T>, const BatchNormOptions&);
FIELDMARK_DUAL_NORM(float)
FIELDMARK_DUAL_NORM(double)
#undef FIELDMARK_DUAL_NORM

}  // namespace fieldmark
