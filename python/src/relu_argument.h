#pragma once
#include <fieldmark/engine/ops/dense.h>

namespace fieldmark::python {

/// What follows an affine map or a convolution whose argument `relu` says so.
constexpr Activation activation(bool relu) { return relu ? Activation::relu : Activation::none; }

}  // namespace fieldmark::python
