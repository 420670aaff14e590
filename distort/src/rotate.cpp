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

template Var<float> rotate(Var<float>, Var<float>, std::span<const float>);
template Var<double> rotate(Var<double>, Var<double>, std::span<const double>);

}  // namespace fieldmark::distort
