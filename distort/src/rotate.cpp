#include "fieldmark/distort/rotate.h"

#include "fieldmark/distort/affine_warp.h"
#include "fieldmark/distort/similarity.h"

namespace fieldmark::distort {

template <class T>
Var<T> rotate(Var<T> x, Var<T> angle, std::span<const std::type_identity_t<T>> background) {
  T* fixed = x.tape().scratch(3);
  fixed[0] = 1;
  fixed[1] = fixed[2] = 0;
  const Var<T> matrix = similarity(angle, x.tape().constant(fixed, {1}), x.tape().constant(fixed + 1, {2}));
  return affine_warp(x, matrix, {.background = background});
}

template <class T>
Tensor<std::int32_t> rotate_labels(const Tensor<std::int32_t>& labels, T angle, std::int32_t background) {
  const auto matrix = similarity_matrix(angle, T(1), T(0), T(0));
  return warp_labels(labels, std::span<const T>(matrix), background);
}

template Var<float> rotate(Var<float>, Var<float>, std::span<const float>);
template Var<double> rotate(Var<double>, Var<double>, std::span<const double>);
template Tensor<std::int32_t> rotate_labels(const Tensor<std::int32_t>&, float, std::int32_t);
template Tensor<std::int32_t> rotate_labels(const Tensor<std::int32_t>&, double, std::int32_t);

}  // namespace fieldmark::distort
