#include "fieldmark/distort/rescale.h"

#include "fieldmark/distort/similarity.h"

namespace fieldmark::distort {

template <class T>
Var<T> rescale(Var<T> x, Var<T> scale, WarpOptions<std::type_identity_t<T>> options) {
  T* zeros = x.tape().scratch(3);
  zeros[0] = zeros[1] = zeros[2] = 0;
  const Var<T> matrix = similarity(x.tape().constant(zeros, {1}), scale, x.tape().constant(zeros + 1, {2}));
  return affine_warp(x, matrix, options);
}

template <class T>
Tensor<std::int32_t> rescale_labels(const Tensor<std::int32_t>& labels, T scale, std::int32_t background,
                                    Index height, Index width) {
  const auto matrix = similarity_matrix(T(0), scale, T(0), T(0));
  return warp_labels(labels, std::span<const T>(matrix), background, height, width);
}

template Var<float> rescale(Var<float>, Var<float>, WarpOptions<float>);
template Var<double> rescale(Var<double>, Var<double>, WarpOptions<double>);
template Tensor<std::int32_t> rescale_labels(const Tensor<std::int32_t>&, float, std::int32_t, Index, Index);
template Tensor<std::int32_t> rescale_labels(const Tensor<std::int32_t>&, double, std::int32_t, Index, Index);

}  // namespace fieldmark::distort
