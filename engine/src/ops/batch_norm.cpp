#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/batch_norm.h>

#include "ops/normalisation.h"

namespace fieldmark {
namespace {

// All pixels of the batch as one image, a group for each channel.
kernels::NormLayout one_image(const Shape& s) { return {1, s[0] * s[1] * s[2], s[3], s[3]}; }

}  // namespace

// Both backwards are derived in ops/normalisation.h.
template <class T>
Var<T> batch_norm(Var<T> x, Var<T> gamma, Var<T> beta, const BatchNormOptions& options,
                  BatchStatistics* statistics) {
  kernels::check_norm("batch_norm", x, gamma, beta, options.eps);
  const Index channels = x.shape()[3];
  auto* mean = x.tape().template scratch<double>(channels);
  auto* variance = x.tape().template scratch<double>(channels);
  kernels::group_statistics(x.tape(), one_image(x.shape()), x.value(), mean, variance);
  if (statistics) {
    statistics->mean.assign(mean, mean + channels);
    statistics->variance.assign(variance, variance + channels);
  }
  return kernels::apply_norm(one_image(x.shape()), x, gamma, beta, mean, variance, options.eps, options.relu,
                             false);
}

template <class T>
Var<T> batch_norm_fixed(Var<T> x, Var<T> gamma, Var<T> beta, std::span<const std::type_identity_t<T>> mean,
                        std::span<const std::type_identity_t<T>> variance, const BatchNormOptions& options) {
  kernels::check_norm("batch_norm_fixed", x, gamma, beta, options.eps);
  const Index channels = x.shape()[3];
  for (const auto& [name, values] : {std::pair{"mean", mean}, std::pair{"variance", variance}})
    if (static_cast<Index>(values.size()) != channels)
      throw ShapeError(std::string("[batch_norm_fixed] ") + name + " must have one element for each of the " +
                       std::to_string(channels) + " channels of x, got " + std::to_string(values.size()));
  auto* m = x.tape().template scratch<double>(channels);
  auto* v = x.tape().template scratch<double>(channels);
  std::copy(mean.begin(), mean.end(), m);
  std::copy(variance.begin(), variance.end(), v);
  for (Index c = 0; c < channels; ++c)
    if (!(v[c] >= 0))
      throw ValueError("[batch_norm_fixed] variance: channel " + std::to_string(c) +
                       " must be 0 or more, got " + number_text(v[c]));
  return kernels::apply_norm(one_image(x.shape()), x, gamma, beta, m, v, options.eps, options.relu, true);
}

template Var<float> batch_norm(Var<float>, Var<float>, Var<float>, const BatchNormOptions&, BatchStatistics*);
template Var<double> batch_norm(Var<double>, Var<double>, Var<double>, const BatchNormOptions&,
                                BatchStatistics*);
template Var<float> batch_norm_fixed(Var<float>, Var<float>, Var<float>, std::span<const float>,
                                     std::span<const float>, const BatchNormOptions&);
template Var<double> batch_norm_fixed(Var<double>, Var<double>, Var<double>, std::span<const double>,
                                      std::span<const double>, const BatchNormOptions&);

}  // namespace fieldmark
